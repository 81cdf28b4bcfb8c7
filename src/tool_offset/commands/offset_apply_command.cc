// trammel offset apply: what takes the measured offsets out, shown, and set only when told to.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/applied_result.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/printer_session.h"
#include "document/interval_text.h"
#include "session/printer_turn.h"
#include "session/run_journal.h"
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/files/offset_file.h"
#include "tool_offset/files/offset_history.h"
#include "tool_offset/offset/correction.h"
#include "tool_offset/procedure/tool_offsets.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::app {
namespace {

using tool_offset::KeptOffset;
using tool_offset::OffsetFirmware;

struct OffsetApplyArguments {
  std::string file;
  std::string firmware = "klipper-tool";
  std::vector<std::string> now;
  std::vector<int> tools;
  bool apply = false;
  bool save = false;
  bool force = false;
  bool dry_run = false;
  std::string history;  ///< empty: that of the state folder
  PrinterOptions printer;
};

struct Change {
  int tool = 0;
  files::MeasuredOffset measured;
  KeptOffset now;
  KeptOffset next;
};

using Known = std::map<int, KeptOffset>;

// T:X,Y
Result<Known> ParseNow(const std::vector<std::string>& texts) {
  Known known;
  constexpr int kMostTool = 99;
  for (const std::string& text : texts) {
    const auto shift = ParseToolShift("--now", text, kMostTool);
    if (!shift) return tl::unexpected(shift.error());
    known[shift->tool] = {shift->x_mm, shift->y_mm};
  }
  return known;
}

Result<std::vector<files::MeasuredOffset>> Chosen(const files::OffsetFile& file,
                                                  const std::vector<int>& tools) {
  if (tools.empty()) return file.good;
  std::vector<files::MeasuredOffset> chosen;
  for (const int tool : tools) {
    bool found = false;
    for (const files::MeasuredOffset& measured : file.good) {
      if (measured.tool == tool) {
        chosen.push_back(measured);
        found = true;
      }
    }
    if (!found) return Fail(fmt::format("--tool {}: the file has no good offset of it", tool));
  }
  return chosen;
}

Result<KeptOffset> NowOf(int tool, OffsetFirmware firmware, const Known& known,
                         const procedure::Session* session) {
  const auto found = known.find(tool);
  if (found != known.end()) return found->second;
  if (session != nullptr) return procedure::ReadToolOffset(*session, tool);
  return Fail(fmt::format(
      "the offset that the firmware keeps now for tool {0} is not known, and the new one follows "
      "from it: give --now {0}:X,Y{1}",
      tool, firmware == OffsetFirmware::kKlipperTool ? ", or --printer ADDRESS" : ""));
}

// To micrometres, as the firmware is told; never "-0.000".
double Micrometres(double value_mm) {
  constexpr double kPerMm = 1000;
  return std::round(value_mm * kPerMm) / kPerMm + 0.0;
}

void Show(const Change& change, OffsetFirmware firmware) {
  fmt::print("tool {}    lands {:+.3f}, {:+.3f} mm beside the reference tool\n", change.tool,
             Micrometres(change.measured.dx_mm), Micrometres(change.measured.dy_mm));
  for (const auto& [axis, interval95_mm] :
       {std::pair{"dx", change.measured.dx95_mm}, std::pair{"dy", change.measured.dy95_mm}}) {
    if (!interval95_mm) continue;
    fmt::print("          {} {}\n", axis,
               report::IntervalText(*interval95_mm, report::kOffsetMillimetres));
  }
  fmt::print("          X offset  {:.3f}  ->  {:.3f} mm\n", Micrometres(change.now.x_mm),
             Micrometres(change.next.x_mm));
  fmt::print("          Y offset  {:.3f}  ->  {:.3f} mm\n", Micrometres(change.now.y_mm),
             Micrometres(change.next.y_mm));
  for (const std::string& line : SetCommands(firmware, change.tool, change.next)) {
    fmt::print("              {}\n", line);
  }
  for (const std::string& line : SaveCommands(firmware, change.tool)) {
    fmt::print("              {}\n", line);
  }
  const std::string advice = SaveAdvice(firmware, change.tool, change.next);
  if (!advice.empty()) fmt::print("          {}\n", advice);
}

bool SamePlace(const KeptOffset& a, const KeptOffset& b) {
  constexpr double kSame_mm = 0.00051;  // firmwares are told micrometres
  return std::abs(a.x_mm - b.x_mm) <= kSame_mm && std::abs(a.y_mm - b.y_mm) <= kSame_mm;
}

/// Whether a measurement was taken out before and did not get lost since, as by a restart: only
/// from the offset under which the sheet was printed may it be taken out.
bool IsDone(const files::OffsetChange& before, const Change& change) {
  if (before.tool != change.tool || before.dx_mm != change.measured.dx_mm ||
      before.dy_mm != change.measured.dy_mm) {
    return false;
  }
  // Begun and cut off: set where the printer has the new offset.
  if (before.stage == files::OffsetStage::kBegun) return SamePlace(before.new_offset, change.now);
  return !SamePlace(before.old_offset, change.now);
}

// Taking the same measurement out twice would move the tool by it again.
Result<void> RefuseTwice(const std::vector<Change>& changes,
                         const OffsetApplyArguments& arguments) {
  if (arguments.force) return {};
  const auto history = files::ReadOffsetChanges(arguments.history);
  if (!history) return tl::unexpected(history.error());
  for (const Change& change : changes) {
    for (const files::OffsetChange& before : *history) {
      if (!IsDone(before, change)) continue;
      return Fail(
          fmt::format("{} was applied to tool {} at {} on {}, from {}: taking it out twice would "
                      "move the tool by as much again. Print and scan another sheet, or say "
                      "--force",
                      arguments.file, change.tool, before.time, before.printer, before.source),
          ErrorKind::kSafety);
    }
  }
  return {};
}

// Tells the file wherever it is looked for from.
std::string Whole(const std::string& file) {
  return std::filesystem::absolute(file).lexically_normal().string();
}

Result<void> Note(const OffsetApplyArguments& arguments, const std::string& printer,
                  const Change& change, files::OffsetStage stage) {
  return files::AppendToHistory(
      arguments.history, {stage, Now("{:%FT%T%z}"), printer, Whole(arguments.file), change.tool,
                          change.measured.dx_mm, change.measured.dy_mm, change.now, change.next});
}

// A sheet shows no more; a file that says so was made by something else, or by hand.
Result<void> RefuseTooFar(const std::vector<Change>& changes,
                          const OffsetApplyArguments& arguments) {
  if (arguments.force) return {};
  for (const Change& change : changes) {
    const double most_mm =
        std::max(std::abs(change.measured.dx_mm), std::abs(change.measured.dy_mm));
    if (most_mm <= tool_offset::kCoarseReach_mm) continue;
    return Fail(
        fmt::format("{}: tool {} would be moved by {:.3f} mm, and a sheet shows {:.4g} mm at "
                    "most: is it the right file? --force sets it all the same",
                    arguments.file, change.tool, most_mm, tool_offset::kCoarseReach_mm),
        ErrorKind::kSafety);
  }
  return {};
}

// Each old value is on the disk before it is replaced.
Result<void> Set(const std::vector<Change>& changes, const OffsetApplyArguments& arguments,
                 const std::string& printer, const procedure::Session& session) {
  using files::OffsetStage;
  if (auto near = RefuseTooFar(changes, arguments); !near) return near;
  if (auto once = RefuseTwice(changes, arguments); !once) return once;
  std::map<int, KeptOffset> set;
  for (const Change& change : changes) {
    auto noted = Note(arguments, printer, change, OffsetStage::kBegun);
    if (!noted) return noted;
    auto done = procedure::SetToolOffset(session, change.tool, change.next);
    if (!done) return done;
    set[change.tool] = change.next;
    fmt::print("applied   tool {}: read back from the printer{}\n", change.tool,
               arguments.save ? "" : "; until the next restart: --save keeps it");
    noted = Note(arguments, printer, change, OffsetStage::kApplied);
    if (!noted) return noted;
  }
  if (arguments.save) {
    if (auto kept = procedure::KeepToolOffsets(session, set); !kept) return kept;
    fmt::print("kept      in the printer's configuration, and read back after its restart\n");
    for (const Change& change : changes) {
      if (auto noted = Note(arguments, printer, change, OffsetStage::kKept); !noted) return noted;
    }
  }
  fmt::print("history   {}\n", arguments.history);
  return {};
}

Result<void> FindHistory(OffsetApplyArguments& arguments) {
  if (!arguments.apply || !arguments.history.empty()) return {};
  const auto folder = files::StateFolder();
  if (!folder) return tl::unexpected(folder.error());
  arguments.history = (*folder / files::kOffsetHistoryFile).string();
  return {};
}

int RunApply(OffsetApplyArguments arguments) {
  const Interrupt interrupt;
  const OffsetFirmware firmware = *tool_offset::ParseOffsetFirmware(arguments.firmware);
  const bool asks_printer = arguments.apply || !arguments.printer.address.empty();
  if (asks_printer && firmware != OffsetFirmware::kKlipperTool) {
    return PrintError(
        {ErrorKind::kInput,
         "--apply and --printer need --for klipper-tool: tell other firmwares' offsets "
         "with --now, and send them the lines yourself"});
  }
  if (arguments.apply && !arguments.now.empty()) {
    return PrintError(
        {ErrorKind::kInput,
         "--now: with --apply the printer itself tells what it has now; leave it out"});
  }
  if (auto found = FindHistory(arguments); !found) return PrintError(found.error());
  const auto file = files::ReadOffsetFile(arguments.file);
  if (!file) return PrintError(file.error());
  for (const std::string& line : file->refused) fmt::print(stderr, "trammel: {}\n", line);
  const auto chosen = Chosen(*file, arguments.tools);
  if (!chosen) return PrintError(chosen.error());
  const auto known = ParseNow(arguments.now);
  if (!known) return PrintError(known.error());
  std::string address;
  std::unique_ptr<machine::Printer> printer;
  settings::ScanSettings scan;
  std::optional<procedure::Session> session;
  if (asks_printer) {
    const auto config = LoadSettings(arguments.printer);
    if (!config) return PrintError(config.error());
    scan = config->scan;
    address = scan.address;
    auto connected = Connect(config->scan, interrupt.token());
    if (!connected) return PrintError(connected.error());
    printer = std::move(*connected);
    session.emplace(procedure::Session{*printer, interrupt.token(), TellOnTerminal});
  }
  std::optional<files::FileLock> turn;  // what is read, noted and set belongs together
  if (arguments.apply) {
    const auto state = files::StateFolder();
    if (!state) return PrintError(state.error());
    auto taken = procedure::TakeTurn(*session, scan, *state, "trammel offset apply");
    if (!taken) return PrintError(taken.error());
    turn.emplace(std::move(*taken));
  }
  std::vector<Change> changes;
  for (const files::MeasuredOffset& measured : *chosen) {
    const auto now = NowOf(measured.tool, firmware, *known, session ? &*session : nullptr);
    if (!now) return PrintError(now.error());
    changes.push_back(
        {measured.tool, measured, *now, Corrected(firmware, *now, measured.dx_mm, measured.dy_mm)});
    Show(changes.back(), firmware);
  }
  if (changes.empty()) return kExitNotTrusted;
  if (arguments.apply) {
    const auto set = Set(changes, arguments, address, *session);
    if (!set) return PrintError(set.error());
    if (file->result)
      NoteApplied({measurement::Instrument::kToolOffset, *file->result, address, {}});
    return kExitGood;
  }
  fmt::print("nothing was changed\n");
  return kExitGood;
}

}  // namespace

void AddOffsetApplyCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command =
      parent.add_subcommand("apply", "the lines that take measured offsets out; --apply sets them");
  const auto arguments = std::make_shared<OffsetApplyArguments>();
  command
      ->add_option("file", arguments->file, "what offset analyze --result kept, or --json printed")
      ->required();
  command->add_option("--for", arguments->firmware, "who keeps the tools' offsets")
      ->check(CLI::IsMember(std::vector<std::string>{"klipper-tool", "klipper-gcode-offset",
                                                     "marlin", "reprapfirmware"}))
      ->capture_default_str();
  command->add_option("--now", arguments->now,
                      "TOOL:X,Y as the firmware keeps it now; may be repeated");
  command->add_option("--tool", arguments->tools, "only this one; may be repeated");
  command->add_flag("--apply", arguments->apply, "set the offsets on the printer")
      ->group("Printer");
  command->add_flag("--save", arguments->save, "keep them beyond a restart, too")
      ->needs("--apply")
      ->group("Printer");
  command
      ->add_flag("--dry-run", arguments->dry_run,
                 "say what would change, and change nothing: as without --apply")
      ->excludes("--apply")
      ->group("Printer");
  command
      ->add_flag("--force,--again", arguments->force,
                 "apply a measurement that was applied before and is there already, and offsets "
                 "beyond what a sheet can show")
      ->needs("--apply")
      ->group("Printer");
  command
      ->add_option("--history", arguments->history,
                   "JSON lines to which every change is added, the old value first; left out: "
                   "offset-history.jsonl in the state folder, whatever the working folder")
      ->group("Printer");
  AddPrinterOptions(*command, arguments->printer);
  command->callback([arguments, &exit_code] { exit_code = RunApply(*arguments); });
}

}  // namespace trammel::app

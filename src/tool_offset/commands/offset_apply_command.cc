// trammel offset apply: shows the corrections of the measured offsets, and sets them only on
// request.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "app/applied_result.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/commands/offset_setting.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/offset/correction.h"
#include "tool_offset/procedure/set_offsets.h"
#include "tool_offset/procedure/tool_offsets.h"

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
  bool undo = false;
  bool dry_run = false;
  bool brief = false;
  std::string history;  ///< empty: that of the state folder
  PrinterOptions printer;
};

using Change = procedure::OffsetCorrection;
using Known = std::map<int, KeptOffset>;

// Parses T:X,Y.
Result<Known> ParseNow(const std::vector<std::string>& texts) {
  Known known;
  constexpr int kMaxTool = 99;
  for (const std::string& text : texts) {
    const auto shift = TRY(ParseToolShift("--now", text, kMaxTool));
    known[shift.tool] = {shift.x_mm, shift.y_mm};
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

/// Returns each tool's present offset in the firmware. Errors name every tool whose offset is
/// unknown.
Result<Known> NowOf(const std::vector<files::MeasuredOffset>& chosen, OffsetFirmware firmware,
                    Known known, const procedure::Session* session) {
  std::string missing;
  for (const files::MeasuredOffset& measured : chosen) {
    if (known.contains(measured.tool)) continue;
    if (session == nullptr) {
      missing += fmt::format(" --now {}:X,Y", measured.tool);
      continue;
    }
    known[measured.tool] = TRY(procedure::ReadToolOffset(*session, measured.tool));
  }
  if (missing.empty()) return known;
  return Fail(fmt::format(
      "each new offset follows from the one that the firmware has now: give{}{}", missing,
      firmware == OffsetFirmware::kKlipperTool ? ", or --printer ADDRESS" : ""));
}

// Returns the absolute path, valid from any folder.
std::string Whole(const std::string& file) {
  return std::filesystem::absolute(file).lexically_normal().string();
}

Result<void> FindHistory(OffsetApplyArguments& arguments) {
  if (!arguments.history.empty() || !(arguments.apply || arguments.undo)) return {};
  auto usual = TRY(UsualOffsetHistory());
  arguments.history = std::move(usual);
  return {};
}

/// Reads the tools' offsets during the print, if the result is in the folder of a print; else
/// nothing. Errors: its start.json cannot be read.
Result<Known> PrintedWith(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path folder =
      fs::is_directory(file, ignored) ? fs::path(file) : fs::absolute(file).parent_path();
  Known known;
  if (!fs::exists(folder / files::kStartFile, ignored)) return known;
  const auto record = TRY(files::ReadStart(folder));
  for (const files::StartedTool& tool : record.tools) {
    if (tool.kept) known[tool.tool] = *tool.kept;
  }
  return known;
}

/// Checks that the reference tool of the measurement still has its offset of then.
Result<void> CheckReference(const Known& printed_with, const measurement::Outcome& result,
                            const procedure::Session& session) {
  for (const auto& [tool, kept] : printed_with) {
    if (result.Find(fmt::format("tool_{}_dx", tool)) != nullptr) continue;  // a measured one
    const auto now = TRY(procedure::ReadToolOffset(session, tool));
    TRY(procedure::CheckSameOffset(tool, kept, now));
  }
  return {};
}

procedure::SetOffsetsOptions SettingOf(const OffsetApplyArguments& arguments,
                                       const std::string& address) {
  procedure::SetOffsetsOptions options = OffsetSetting(arguments.history, address);
  options.source = arguments.file.empty() ? "" : Whole(arguments.file);
  options.save = arguments.save;
  options.force = arguments.force;
  return options;
}

void PrintHowLong(const OffsetApplyArguments& arguments) {
  if (arguments.brief) {
    fmt::print(
        "until Klipper restarts; SAVE_TOOL_PARAMETER of gcode_x_offset and gcode_y_offset, "
        "then SAVE_CONFIG keeps it\n");
    return;
  }
  if (!arguments.save) fmt::print("          until the next restart: --save keeps it beyond\n");
  fmt::print("history   {}\n", arguments.history);
}

void PrintHowToUndo(const OffsetApplyArguments& arguments) {
  const auto usual = UsualOffsetHistory();
  const bool own = !usual || arguments.history != *usual;
  PrintWrapped("undo",
               fmt::format("trammel offset apply --undo{}{}{}", arguments.save ? " --save" : "",
                           own ? " --history " + ShellQuoted(arguments.history) : "",
                           PrinterOptionText(arguments.printer)),
               10);
}

/// Shows the last application, and reverts it unless nothing is to be changed.
Result<void> Undo(const OffsetApplyArguments& arguments, const procedure::Session& session,
                  const std::string& address) {
  const auto options = SettingOf(arguments, address);
  const auto undo = TRY(PlanUndo(session, options));
  fmt::print("applied   {}\n", undo.source);
  for (const Change& change : undo.changes) fmt::print("{}", UndoText(change));
  if (arguments.dry_run) {
    fmt::print("nothing was changed\n");
    return {};
  }
  TRY(UndoOffsets(session, undo, options));
  NoteLastUndone(measurement::Instrument::kToolOffset, address);
  if (undo.was_kept && !arguments.save) {
    fmt::print(
        "notice    the printer's configuration still has what was undone: the next "
        "restart brings that back, unless offset apply --undo --save keeps this\n");
  }
  PrintHowLong(arguments);
  return {};
}

int RunUndo(OffsetApplyArguments arguments) {
  const Interrupt interrupt;
  if (auto found = FindHistory(arguments); !found) return PrintError(found.error());
  const auto config = LoadSettings(arguments.printer);
  if (!config) return PrintError(config.error());
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return PrintError(printer.error());
  const procedure::Session session{**printer, interrupt.token(), ShowProgress};
  const auto state = files::StateFolder();
  if (!state) return PrintError(state.error());
  const auto turn = TakeTurn(session, config->scan, *state, "trammel offset apply");
  if (!turn) return PrintError(turn.error());
  const auto done = Undo(arguments, session, config->scan.address);
  return done ? static_cast<int>(kExitGood) : PrintError(done.error());
}

/// Prints, without the present offsets, where each tool lands, and the change of its offset.
int ShowSteps(const std::vector<files::MeasuredOffset>& chosen, OffsetFirmware firmware) {
  std::string now;
  for (const files::MeasuredOffset& measured : chosen) {
    fmt::print("{}", StepText(measured, firmware));
    now += fmt::format(" --now {}:X,Y", measured.tool);
  }
  fmt::print("nothing was changed; the commands that set it: with{}{}\n", now,
             firmware == OffsetFirmware::kKlipperTool ? " as it is now, or --printer ADDRESS"
                                                      : " as it is now");
  return kExitGood;
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
    session.emplace(procedure::Session{*printer, interrupt.token(), ShowProgress});
  }
  std::optional<files::FileLock> turn;  // held while offsets are read, recorded and set
  if (arguments.apply) {
    const auto state = files::StateFolder();
    if (!state) return PrintError(state.error());
    auto taken = procedure::TakeTurn(*session, scan, *state, "trammel offset apply");
    if (!taken) return PrintError(taken.error());
    turn.emplace(std::move(*taken));
  }
  const auto printed_with = PrintedWith(arguments.file);
  if (!printed_with) return PrintError(printed_with.error());
  if (chosen->empty()) return kExitNotTrusted;
  if (!session && known->empty() && !arguments.brief) return ShowSteps(*chosen, firmware);
  const auto now = NowOf(*chosen, firmware, *known, session ? &*session : nullptr);
  if (!now) return PrintError(now.error());
  std::vector<Change> changes;
  for (const files::MeasuredOffset& measured : *chosen) {
    const KeptOffset& kept_now = now->at(measured.tool);
    changes.push_back({measured.tool, measured, kept_now,
                       Corrected(firmware, kept_now, measured.dx_mm, measured.dy_mm)});
    if (const auto kept = printed_with->find(measured.tool); kept != printed_with->end()) {
      changes.back().when_printed = kept->second;
    }
    fmt::print("{}", arguments.brief ? BriefCorrection(changes.back())
                                     : CorrectionText(changes.back(), firmware));
  }
  if (arguments.apply && !arguments.force) {
    auto same = CheckReference(*printed_with, file->result, *session);
    if (!same) return PrintError(same.error());
  }
  if (arguments.apply) {
    auto setting = SettingOf(arguments, address);
    bool any_set = false;  // with several tools the first may be set, and the next not
    setting.say = [&any_set, say = std::move(setting.say)](const std::string& done) {
      any_set = true;
      if (say) say(done);
    };
    const auto set = SetOffsets(*session, changes, setting);
    if (any_set) {
      NoteApplied({measurement::Instrument::kToolOffset, file->result, address, {}});
    }
    if (!set) return PrintError(set.error());
    PrintHowLong(arguments);
    if (!arguments.brief) PrintHowToUndo(arguments);
    return kExitGood;
  }
  fmt::print("nothing was changed\n");
  if (firmware == OffsetFirmware::kKlipperTool && !arguments.brief) {
    const std::string printer = PrinterOptionText(arguments.printer);
    PrintWrapped("next",
                 fmt::format("trammel offset apply {} --apply{}", ShellQuoted(arguments.file),
                             printer.empty() ? " --printer HOST" : printer),
                 10);
  }
  return kExitGood;
}

}  // namespace

void AddOffsetApplyCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command =
      parent.add_subcommand("apply", "the lines that take measured offsets out; --apply sets them");
  const auto arguments = std::make_shared<OffsetApplyArguments>();
  CLI::Option* const file = command->add_option(
      "file", arguments->file, "what offset analyze --result kept, or a folder of offset start");
  CLI::Option* const undo =
      command
          ->add_flag("--undo", arguments->undo,
                     "instead of a file: the offsets from before trammel set the last ones")
          ->excludes(file)
          ->group("Printer");
  command->add_option("--for", arguments->firmware, "who keeps the tools' offsets")
      ->check(CLI::IsMember(std::vector<std::string>{"klipper-tool", "klipper-gcode-offset",
                                                     "marlin", "reprapfirmware"}))
      ->capture_default_str();
  command->add_option("--now", arguments->now,
                      "TOOL:X,Y as the firmware keeps it now; may be repeated");
  command->add_option("--tool", arguments->tools, "only this one; may be repeated");
  command->add_flag("--apply", arguments->apply, "set the offsets on the printer")
      ->excludes(undo)
      ->group("Printer");
  command->add_flag("--save", arguments->save, "keep them beyond a restart, too")->group("Printer");
  command->add_flag("--brief", arguments->brief, "a line for each tool, for a printer's screen")
      ->excludes("--save")
      ->group("Printer");
  command
      ->add_flag("--dry-run", arguments->dry_run,
                 "say what would change, and change nothing: as without --apply")
      ->excludes("--apply")
      ->group("Printer");
  command
      ->add_flag("--force,--again", arguments->force,
                 "apply a measurement that was applied before and is there already, one of another "
                 "offset than the printer has now, and offsets beyond what a sheet can show; undo, "
                 "whatever was set since")
      ->group("Printer");
  command
      ->add_option("--history", arguments->history,
                   "JSON lines to which every change is added, the old value first; left out: "
                   "offset-history.jsonl in the state folder, whatever the working folder")
      ->group("Printer");
  AddPrinterOptions(*command, arguments->printer);
  command->callback([arguments, &exit_code] {
    if (!arguments->undo && arguments->file.empty()) throw CLI::RequiredError("file or --undo");
    for (const auto& [given, name] :
         {std::pair{arguments->save, "--save"}, std::pair{arguments->force, "--force"}}) {
      if (given && !arguments->apply && !arguments->undo) {
        throw CLI::RequiresError(name, "--apply or --undo");
      }
    }
    exit_code = arguments->undo ? RunUndo(*arguments) : RunApply(*arguments);
  });
}

}  // namespace trammel::app

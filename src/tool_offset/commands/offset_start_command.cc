// trammel offset start: guides from the tools of a printer to their new offsets, step by step.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/applied_result.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/terminal_operator.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"
#include "settings/material.h"
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/commands/offset_recording.h"
#include "tool_offset/commands/offset_setting.h"
#include "tool_offset/commands/sheet_options.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/procedure/guided_offsets.h"
#include "tool_offset/procedure/sheet_print.h"
#include "tool_offset/procedure/tool_offsets.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using files::StartRecord;
using procedure::PrinterTools;
using procedure::Session;

struct StartArguments {
  SheetOptions sheet;
  std::string printer;
  std::vector<int> tools;
  std::string out;
  std::string watch;
  std::string scan;
  std::string go_on;  ///< a folder of an earlier start
  bool print_only = false;
  std::vector<std::string> yes;
  ReadingOptions reading;
};

/// Data of a printed sheet, also after an interrupted start.
struct Printed {
  fs::path folder;
  tool_offset::SheetPlan plan;
  StartRecord record;
  std::string why_not_set;  ///< why the printer's offsets cannot be set; empty: they can
  bool as_it_was = true;    ///< all but what was printed
};

/// Connection, open as long as it is needed.
struct Connection {
  std::unique_ptr<machine::Printer> printer;
  Session session;
};

Result<Connection> ConnectTo(const settings::ScanSettings& settings, const Interrupt& interrupt) {
  auto printer = TRY(Connect(settings, interrupt.token()));
  machine::Printer& reference = *printer;
  return Connection{std::move(printer), {reference, interrupt.token(), ShowProgress}};
}

/// Asks for the loaded material: nothing is heated on a guess.
Result<void> AskMaterial(TerminalOperator& person, SheetConfig& config) {
  while (FindTemperatureProblem(config.sheet) && person.present()) {
    std::string names;
    for (const settings::Material& material : settings::Materials()) {
      names += fmt::format("{}{}", names.empty() ? "" : ", ", material.name);
    }
    fmt::print(stderr, "which material is loaded in all tools ({})? ", names);
    std::fflush(stderr);
    for (;;) {
      constexpr double kStep_s = 1;
      const auto line = TRY(person.LineWithin(kStep_s));
      if (!line) continue;
      const std::string name(WithoutSpaces(*line));
      if (settings::FindMaterial(name) != nullptr) config.sheet.filament.material = name;
      break;
    }
  }
  return {};
}

void PrintTools(const SheetConfig& config, const PrinterTools& found) {
  fmt::print("printer    {}\n", procedure::PrinterName(config.config.scan.address));
  for (const procedure::PrinterTool& tool : found.tools) {
    const auto& chosen = config.sheet.tools;
    const bool drawn = std::find(chosen.begin(), chosen.end(), tool.number) != chosen.end();
    fmt::print("tool {:<5} {}, {}{}\n", tool.number, tool.extruder,
               tool.kept ? fmt::format("keeps {:.3f}, {:.3f} mm", tool.kept->x_mm, tool.kept->y_mm)
                         : std::string("Klipper tells no offset of it"),
               tool.number == config.sheet.reference_tool ? "; the reference"
               : drawn                                    ? ""
                                                          : "; not on this sheet");
  }
  for (const std::string& notice : found.notices) fmt::print("notice     {}\n", notice);
}

StartRecord RecordOf(const SheetConfig& config, const PrinterTools& found) {
  StartRecord record;
  record.printer = procedure::PrinterName(config.config.scan.address);
  record.run = NewRunName();
  record.started = UtcNow();
  for (const int tool : config.sheet.tools) {
    const procedure::PrinterTool* const known = found.Find(tool);
    record.tools.push_back({tool, known ? known->kept : std::nullopt});
  }
  return record;
}

/// Reports, like CalibrateInto, each unrestored setting, whatever else failed.
Result<void> DoneOf(const procedure::GuardedOutcome& outcome) {
  std::string unrestored;
  for (const std::string& failure : outcome.unrestored) {
    fmt::print(stderr, "trammel: NOT AS IT WAS: {}\n", failure);
    unrestored += (unrestored.empty() ? "" : "; ") + failure;
  }
  if (!outcome.done || unrestored.empty()) return outcome.done;
  return Fail("the printer is not as it was: " + unrestored, ErrorKind::kMachine);
}

/// Reads the tools, plans the sheet, and prints it.
Result<Printed> PrintNew(const StartArguments& arguments, SheetConfig& config,
                         const Interrupt& interrupt, TerminalOperator& person) {
  auto connection = TRY(ConnectTo(config.config.scan, interrupt));
  Session& session = connection.session;
  const auto found = TRY(ReadTools(session));
  TRY(FitToPrinter(arguments.sheet, arguments.tools, session, found, config));
  TRY(AskMaterial(person, config));
  TRY(CheckSheet(config));
  const auto folder = TRY(NewFolder::Make(
      arguments.out.empty()
          ? fs::path("recordings") / RecordingName(measurement::Instrument::kToolOffset)
          : fs::path(arguments.out)));
  procedure::SheetPrint print{tool_offset::PlanSheet(config.sheet),
                              &config.config.scan,
                              found,
                              folder.path(),
                              {},
                              RecordOf(config, found)};
  const auto gcode = WriteSheetGcode(print.plan, tool_offset::PaperComes::kBefore);
  const fs::path pattern = folder.path() / procedure::kSheetGcodeName;
  Result<void> done = WriteSheet(pattern, print.plan, gcode);
  if (done) {
    PrintTools(config, found);
    PrintSheetPlan(config.sheet, print.plan, gcode);
    fmt::print("bed        {:.4g} x {:.4g} mm, as [printer] has it\n",
               config.sheet.printer.bed_size_x_mm, config.sheet.printer.bed_size_y_mm);
    fmt::print("drawing    {}\n", (folder.path() / "pattern.png").string());
    std::fflush(stdout);
    done = DoneOf(PrintSheet(session, print, person));
  }
  std::error_code ignored;
  if (!fs::exists(folder.path() / files::kStartFile, ignored)) RemoveSheet(pattern);
  // A printed sheet can be read even if something is not restored.
  if (!done && print.record.stage != files::StartStage::kPrinted) {
    return tl::unexpected(done.error());
  }
  if (!done) fmt::print(stderr, "trammel: {}\n", done.error().message);
  return Printed{folder.path(), std::move(print.plan), std::move(print.record),
                 WhyNotSet(found.keeper), done.has_value()};
}

/// Continues an earlier start that was interrupted.
Result<Printed> GoOn(const fs::path& folder, const SheetConfig& config,
                     const Interrupt& interrupt) {
  auto record = TRY(files::ReadStart(folder));
  const std::string pattern = (folder / procedure::kSheetGcodeName).string();
  auto plan = TRY(ReadPlan(pattern));
  if (record.stage == files::StartStage::kPrinting) {
    const std::string by_hand = fmt::format(
        "where it was printed to its end all the same, trammel offset analyze SCAN --pattern {} "
        "reads it",
        pattern);
    auto connection = TRY(ConnectTo(config.config.scan, interrupt));
    const auto printed = TRY(WasPrinted(connection.session, record.run));
    if (!printed) {
      return Fail(
          fmt::format("{}: the start of {} ended while it printed, and the printer does not "
                      "say that the print was finished: begin again; {}",
                      folder.string(), record.started, by_hand),
          ErrorKind::kMachine);
    }
    record.stage = files::StartStage::kPrinted;
    TRY(files::WriteStart(folder, record));
  }
  const bool told =
      std::all_of(record.tools.begin(), record.tools.end(),
                  [](const files::StartedTool& tool) { return tool.kept.has_value(); });
  return Printed{folder, std::move(plan), std::move(record),
                 told ? "" : "Klipper tells no offsets of this printer's tools"};
}

/// @returns whether every tool has a value.
Result<bool> Analyse(const StartArguments& arguments, const Printed& printed,
                     TerminalOperator& person) {
  SheetReader reader(printed.folder, printed.plan, printed.record, arguments.reading);
  constexpr std::int64_t kClocks_s = 10;  // clock error of another computer
  const std::int64_t since_s = printed.record.printed_s - kClocks_s;
  if (!arguments.scan.empty()) {
    if (procedure::IsOlder(arguments.scan, since_s)) {
      return Fail(fmt::format("--scan {}: was written before the sheet was printed, and an earlier "
                              "print of the same sheet has the same number; where it is the scan "
                              "of this print, touch it",
                              arguments.scan),
                  ErrorKind::kSafety);
    }
    TRY(reader.Read(arguments.scan));
    return reader.all_good();
  }
  const auto own = TRY(ScanFolderOf(printed.folder));
  procedure::ScanWait wait;
  wait.folder = arguments.watch.empty() ? own : fs::path(arguments.watch);
  wait.since_s = since_s;
  wait.read = [&reader](const fs::path& path) { return reader.Read(path); };
  wait.say = [](const std::string& line) { fmt::print(stderr, "  {}\n", line); };
  fmt::print(stderr,
             "the sheet is printed. Take it off once the bed is cold, scan it with 300 to 600 dpi "
             "or photograph it, and put the file into\n    {}\n{}",
             wait.folder.string(),
             person.present() ? "Ctrl-C, and --continue goes on later\n" : "");
  TRY(WaitForScan(person, wait));
  return reader.all_good();
}

void PrintNothingSet(const Printed& printed) {
  if (printed.why_not_set.empty()) {
    fmt::print("nothing applied   trammel offset apply {} --apply --printer {}\n",
               printed.folder.string(), printed.record.printer);
    return;
  }
  fmt::print(
      "nothing applied   {}\n"
      "                  trammel offset apply {} --for klipper-gcode-offset --now TOOL:X,Y\n",
      printed.why_not_set, printed.folder.string());
}

// Prints the printer's own commands: the measurement is applied already, and must not be again.
void PrintHowToKeep(const std::vector<procedure::OffsetCorrection>& corrections) {
  fmt::print("until the next restart; to keep it, in the printer's console:\n");
  for (const procedure::OffsetCorrection& change : corrections) {
    for (const std::string& line :
         SaveCommands(tool_offset::OffsetFirmware::kKlipperTool, change.tool)) {
      fmt::print("                  {}\n", line);
    }
  }
  fmt::print("                  SAVE_CONFIG\n");
}

/// Shows old and new offsets, and sets them after a yes.
Result<void> Settle(const SheetConfig& config, const Printed& printed, const Interrupt& interrupt,
                    TerminalOperator& person) {
  const auto measured = TRY(files::ReadOffsetFile(printed.folder));
  procedure::OffsetSettling settling;
  settling.settings = &config.config.scan;
  settling.record = printed.record;
  settling.corrections = procedure::CorrectionsOf(printed.record, measured);
  for (const procedure::OffsetCorrection& change : settling.corrections) {
    if (change.tool == printed.plan.settings.reference_tool) continue;
    fmt::print("T{} -> T{}\n{}", printed.plan.settings.reference_tool, change.tool,
               CorrectionText(change, tool_offset::OffsetFirmware::kKlipperTool));
  }
  std::fflush(stdout);
  if (settling.corrections.empty() || !printed.why_not_set.empty() ||
      !person.CheckCanAnswer(procedure::kApplyQuestion)) {
    PrintNothingSet(printed);
    return {};
  }
  auto state = TRY(files::StateFolder());
  settling.state_folder = std::move(state);
  const auto history = TRY(UsualOffsetHistory());
  settling.setting = OffsetSetting(history, config.config.scan.address);
  settling.setting.source = fs::absolute(printed.folder).lexically_normal().string();
  auto connection = TRY(ConnectTo(config.config.scan, interrupt));
  const Session& session = connection.session;
  const auto set = TRY(SetWhereWanted(session, settling, person));
  if (!set) {
    PrintNothingSet(printed);
    return {};
  }
  NoteApplied(
      {measurement::Instrument::kToolOffset, measured.result, config.config.scan.address, {}});
  const auto kept = KeepWhereWanted(session, settling, person);
  if (!kept || !*kept) PrintHowToKeep(settling.corrections);
  fmt::print("to undo it        trammel offset apply --undo{} --printer {}\n",
             kept && *kept ? " --save" : "", printed.record.printer);
  if (!kept) return tl::unexpected(kept.error());
  fmt::print("next              print another sheet and look for zero: trammel offset start\n");
  return {};
}

int Report(const Error& error, const std::optional<Printed>& printed) {
  const int code = PrintError(error);
  if (printed) {
    fmt::print(stderr, "trammel: to go on: trammel offset start --continue {} --printer {}\n",
               printed->folder.string(), printed->record.printer);
  }
  return code;
}

int RunStart(const StartArguments& arguments) {
  const Interrupt interrupt;
  TerminalOperator person(interrupt.token(), {arguments.yes.begin(), arguments.yes.end()});
  auto config = ConfigureForPrinter(arguments.sheet, arguments.printer);
  if (!config) return PrintError(config.error());
  auto printed = arguments.go_on.empty() ? PrintNew(arguments, *config, interrupt, person)
                                         : GoOn(arguments.go_on, *config, interrupt);
  if (!printed) return PrintError(printed.error());
  if (!arguments.go_on.empty() &&
      printed->record.printer != procedure::PrinterName(config->config.scan.address)) {
    return PrintError({ErrorKind::kInput,
                       fmt::format("{} is of the printer {}, and {} is asked for: say --printer {}",
                                   arguments.go_on, printed->record.printer,
                                   procedure::PrinterName(config->config.scan.address),
                                   printed->record.printer)});
  }
  if (arguments.print_only) {
    fmt::print("to go on          trammel offset start --continue {} --printer {}\n",
               printed->folder.string(), printed->record.printer);
    return printed->as_it_was ? kExitGood : kExitMachine;
  }
  bool all_good = true;
  if (printed->record.stage != files::StartStage::kAnalysed) {
    const auto analysed = Analyse(arguments, *printed, person);
    if (!analysed) return Report(analysed.error(), *printed);
    all_good = *analysed;
  }
  if (auto settled = Settle(*config, *printed, interrupt, person); !settled) {
    return Report(settled.error(), *printed);
  }
  return all_good ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddOffsetStartCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "start", "guide through it: the sheet onto paper, its scan, and the printer's new offsets");
  const auto arguments = std::make_shared<StartArguments>();
  AddAddressOption(*command, arguments->printer);
  AddSheetOptions(*command, arguments->sheet);
  command
      ->add_option("--tools", arguments->tools,
                   "these alone, as in 0,2; left out: all that the printer has")
      ->delimiter(',')
      ->check(CLI::Range(0, 31));
  command->add_option("-o,--out", arguments->out, "new folder for everything that is recorded");
  command
      ->add_option("--watch", arguments->watch,
                   "folder into which the scan will be put; left out: scan/ of the recording")
      ->check(CLI::ExistingDirectory);
  CLI::Option* const scan =
      command->add_option("--scan", arguments->scan, "with --continue: the scan, which is there")
          ->excludes("--watch");
  CLI::Option* const go_on = command->add_option("--continue", arguments->go_on,
                                                 "go on with this folder, whose sheet was printed");
  scan->needs(go_on);
  command
      ->add_flag("--print-only", arguments->print_only,
                 "end once the sheet is printed: --continue, or offset measure, goes on")
      ->excludes(go_on)
      ->excludes("--watch");
  command
      ->add_option("--yes", arguments->yes,
                   "answers a question beforehand, for runs without a terminal: move (the printer "
                   "may home and pick up a tool), paper (it is taped down already, it may heat "
                   "and print), apply, keep; may be repeated")
      ->delimiter(',')
      ->check(CLI::IsMember(
          std::set<std::string>{procedure::kMoveQuestion, procedure::kPaperQuestion,
                                procedure::kApplyQuestion, procedure::kKeepQuestion}));
  AddReadingOptions(*command, arguments->reading);
  command->callback([arguments, &exit_code] { exit_code = RunStart(*arguments); });
}

}  // namespace trammel::app

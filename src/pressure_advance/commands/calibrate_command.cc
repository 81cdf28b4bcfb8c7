// trammel pa calibrate, and its parts trammel pa print and trammel pa scan.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "app/applied_result.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/kept_history.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/apply_command.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/conditions_run.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "session/checks.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNamedMaterial =
    "; a material in its name (\"PETG Jet\") is what is printed, unless --material names one";

struct CalibrateArguments {
  PrinterOptions printer;
  std::string out;
  std::string plan;  // plan for pa scan
  std::string filament;
  std::optional<int> only;
  AskedPlate plate;
  bool print = true;
  bool scan = true;
  bool apply = false;
  bool dry_run = false;
  bool json = false;
  bool keep_full = false;
};

// Returns the plan given to a command.
Result<pressure_advance::PatternPlan> NamedPlan(const std::string& file) {
  auto plan = ReadPatternPlan(file);
  if (!plan) {
    return Fail(fmt::format("{}; trammel pa pattern and trammel pa print write the plan beside "
                            "the G-code: name it with --plan",
                            plan.error().message),
                plan.error().kind);
  }
  plan->gcode = "pattern.gcode";  // copy in the recording
  return plan;
}

// Finds the plan of the pattern on the bed, if none is given.
Result<pressure_advance::PatternPlan> PlanOnBed(const std::string& address) {
  auto lying = TRY(FindLyingPattern(address));
  const auto& lines = lying.plan.lines;
  const auto [least, most] =
      std::ranges::minmax(lines, {}, &pressure_advance::PlanLine::pressure_advance_s);
  fmt::print(stderr,
             "  taking what lies on the bed for the last pattern that was printed there ({}, {}): "
             "{} lines, {:.4g} to {:.4g} s; --plan names another\n",
             lying.print.utc, lying.print.folder, lines.size(), least.pressure_advance_s,
             most.pressure_advance_s);
  return std::move(lying.plan);
}

// Describes a change of the printer's spool meanwhile; empty if there is none.
std::string SpoolChange(const machine::Spool& before, const std::optional<machine::Spool>& now) {
  if (now && now->id == before.id) return "";
  return fmt::format(
      "Spoolman's active spool changed meanwhile, from {} ({}) to {}: the result is listed under "
      "the first one; if another filament was printed, calibrate anew",
      before.id, before.filament, now ? fmt::format("{} ({})", now->id, now->filament) : "none");
}

// Reports the result, and applies it if requested.
Result<int> Conclude(const CalibrateArguments& arguments, const procedure::Session& session,
                     const files::Config& config, const fs::path& folder,
                     const std::optional<machine::Spool>& spool_before) {
  session.Report({.text = "analysing", .remaining_s = {}, .phase = "analysing"});
  auto run = TRY(AnalyseRecording(folder));
  if (!arguments.json) PrintAnswer(run.analysis);
  const bool wanted = arguments.filament.empty() && !spool_before;
  const auto spool_now = SpoolNow(session, wanted);
  if (spool_before) {
    const std::string change = SpoolChange(*spool_before, spool_now);
    if (!change.empty()) run.analysis.notices.push_back(change);
    if (!change.empty() && !arguments.json) fmt::print("notice            {}\n", change);
  }
  ResultFile result = ResultOf(run.analysis, folder.string());
  result.outcome.subject =
      SubjectOf(arguments.filament, session, config, spool_before ? spool_before : spool_now);
  const int code = WriteAnalysis(run, result, KeptIn(folder, arguments.json));
  const Measured& measured = run.analysis.pressure_advance;
  if (!measured.good()) return code;
  if (!arguments.json) PrintDrift(fs::absolute(folder).parent_path(), result.outcome);
  const double value_s = measured.quantity().value;
  if (arguments.apply) {
    const auto state = TRY(files::StateFolder());
    const auto turn = TRY(procedure::TakeTurn(session, config.scan, state, "trammel pa calibrate"));
    procedure::ApplyOptions options;
    options.limit_s = procedure::ApplyLimit_s(config.pattern);
    const AppliedValue applied{measurement::Instrument::kPressureAdvance, result.outcome,
                               config.scan.address, value_s};
    options.before_setting = [&](const procedure::PressureAdvanceChange& change) {
      return NoteBegun(applied, change.before_s, procedure::BeforeEach(change));
    };
    TRY(Apply(session, value_s, options, arguments.json));
    NoteApplied(applied);
    if (!arguments.json) PrintHowToUndo(arguments.printer);
    return code;
  }
  if (!arguments.json) {
    PrintWrapped("nothing applied",
                 fmt::format("trammel pa apply {}{}", ShellQuoted(folder.string()),
                             PrinterOptionText(arguments.printer)));
    ExplainKeeping(value_s, session);
  }
  return code;
}

struct Ran {
  fs::path folder;
  double bed_c = 0;  // bed temperature
};

Result<Ran> Run(const CalibrateArguments& arguments, const procedure::Session& session,
                procedure::CalibrationRequest request) {
  const auto folder = TRY(NewFolder::Make(arguments.out));
  request.folder = folder.path();
  if (request.print && request.scan) {
    const MachineTime time = MachineTimeOf(request.pattern, request.settings);
    session.Report(fmt::format("print {:.0f} s and scan {:.0f} s, heating apart",
                               time.print.total_s(), time.scan ? time.scan->total_s() : 0));
  }
  const CalibrationRun run = CalibrateInto(session, request);
  if (run.done) return Ran{folder.path(), run.bed_c};
  // The printer was not restored; the recording is analysed all the same.
  if (run.recorded && request.scan && !arguments.json) {
    const auto analysed = AnalyseRecording(folder.path());
    if (analysed) PrintAnswer(analysed->analysis);
  }
  return tl::unexpected(run.done.error());
}

// Returns the settings, with the temperatures of the filament's name unless the command line names
// a material.
Result<files::Config> HeatedSettings(const CalibrateArguments& arguments) {
  auto config = LoadSettings(arguments.printer);
  if (!config || config->options.contains("filament.material")) return config;
  const settings::Material* const named = settings::MaterialInName(arguments.filament);
  if (!arguments.print || named == nullptr) return config;
  return LoadSettingsFor(std::string(named->name),
                         config->options.contains("filament.nozzle_temperature"),
                         "name --material, or --set nozzle_temperature=…", arguments.printer);
}

// Returns the settings, with the pattern for a photo, which the command line overrides.
Result<files::Config> ConfigOf(const CalibrateArguments& arguments) {
  auto config = HeatedSettings(arguments);
  if (!config || !arguments.plate.photo) return config;
  SetForPhoto(config->pattern);
  for (const std::string& assignment : arguments.printer.set) {
    TRY(files::OverrideConfig(assignment, *config));
  }
  TRY(Validate(config->pattern));
  return config;
}

int PrintLayout(const CalibrateArguments& arguments, const Ran& ran) {
  const fs::path plan = ran.folder / "pattern.plan.json";
  if (arguments.plate.photo) {
    fmt::print("printed           for a photo; everything is off, as the end G-code left it\n");
    PrintWrapped("to measure it", "let the bed cool, take a photo from straight above, and");
    PrintWrapped("", "trammel pa analyze PHOTO --plan " + ShellQuoted(plan.string()));
    return kExitGood;
  }
  fmt::print("printed           {}\n",
             ran.bed_c > 0 ? fmt::format("the bed stays at {:.0f} degC and holds it", ran.bed_c)
                           : "the bed is off, as the file left it");
  PrintWrapped("to scan it", fmt::format("trammel pa scan --plan {}{}", ShellQuoted(plan.string()),
                                         PrinterOptionText(arguments.printer)));
  return kExitGood;
}

Result<int> RunCalibration(const CalibrateArguments& arguments) {
  const Interrupt interrupt;
  auto config = TRY(ConfigOf(arguments));
  TRY(CheckFilamentOption(arguments.filament));
  if (arguments.dry_run) {
    TRY(FitForDryRun(arguments.printer, interrupt.token(), config));
    TRY(LayOnPlate(arguments.plate, BedOf(config.pattern), config));
    TRY(PrintDryRun(config.pattern, config.scan,
                    {arguments.print, arguments.scan, arguments.plate.photo}));
    return kExitGood;
  }
  auto request = RequestFor(config, {});
  request.print = arguments.print;
  request.scan = arguments.scan;
  request.for_photo = arguments.plate.photo;
  request.filament = arguments.filament;
  request.only = arguments.only;
  if (!arguments.print) {
    request.plan =
        TRY(arguments.plan.empty() ? PlanOnBed(config.scan.address) : NamedPlan(arguments.plan));
  }
  if (arguments.print) {
    TRY(settings::ValidateTemperatures(config.pattern));
  }
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  TRY(FitPattern(session, config));
  TRY(LayOnPlateOf(arguments.plate, session, config));
  if (arguments.plate.conditions.any()) {
    return RunConditions(
        {config, arguments.out, arguments.filament, arguments.json, arguments.keep_full}, session);
  }
  request.pattern = config.pattern;
  const auto spool = arguments.scan ? SpoolNow(session, false) : std::nullopt;
  const auto ran = TRY(Run(arguments, session, request));
  if (arguments.scan) {
    const auto code = Conclude(arguments, session, config, ran.folder, spool);
    if (!arguments.keep_full) CutRecordings({ran.folder}, interrupt.token());
    return code;
  }
  return PrintLayout(arguments, ran);
}

CLI::App* AddStep(CLI::App& parent, int& exit_code, const char* name, const char* text,
                  const std::shared_ptr<CalibrateArguments>& arguments) {
  CLI::App* command = parent.add_subcommand(name, text);
  AddPrinterOptions(*command, arguments->printer);
  command->add_option("-o,--out", arguments->out, "new folder for everything that is recorded");
  if (arguments->scan) {
    AddCameraOption(*command, arguments->printer);
    command->add_flag("--json", arguments->json, "print the answer as one JSON object");
    command->add_flag("--apply", arguments->apply, "set the answer on the printer if it is good");
    AddKeepFullOption(*command, arguments->keep_full);
    command->add_option("--filament", arguments->filament,
                        "which filament it is: trammel history lists the result under it; "
                        "without it, the one of Spoolman's active spool" +
                            std::string(arguments->print ? kNamedMaterial : ""));
  }
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunCalibration(*arguments)); });
  return command;
}

void AddDryRun(CLI::App& command, CalibrateArguments& arguments, const char* text) {
  command.add_flag("--dry-run", arguments.dry_run, text);
}

}  // namespace

void AddCalibrateCommands(CLI::App& parent, int& exit_code) {
  const auto whole = std::make_shared<CalibrateArguments>();
  CLI::App* calibrate = AddStep(parent, exit_code, "calibrate",
                                "print the pattern, scan it, and say the answer", whole);
  AddMaterialOption(*calibrate, whole->printer.material);
  AddDryRun(*calibrate, *whole, "print the G-code and the sweeps, do nothing");
  AddPlateOptions(*calibrate, whole->plate, {calibrate->get_option("--apply")});

  const auto print_only = std::make_shared<CalibrateArguments>();
  print_only->scan = false;
  CLI::App* print = AddStep(parent, exit_code, "print",
                            "print the pattern and leave it on the warm bed", print_only);
  AddMaterialOption(*print, print_only->printer.material);
  AddDryRun(*print, *print_only, "print the G-code and the sweeps, do nothing");
  CLI::Option* photo = print->add_flag("--photo", print_only->plate.photo,
                                       "the pattern of pa pattern --photo; needs no laser, and "
                                       "everything is off afterwards");
  print
      ->add_option("--filament", print_only->filament,
                   "which filament it is: pa photo measures no photo of it for another one" +
                       std::string(kNamedMaterial))
      ->needs(photo);

  const auto scan_only = std::make_shared<CalibrateArguments>();
  scan_only->print = false;
  CLI::App* scan = AddStep(parent, exit_code, "scan",
                           "scan a pattern that is on the bed, and say the answer", scan_only);
  AddDryRun(*scan, *scan_only, "print the sweeps of the settings' pattern, do nothing");
  scan->add_option("--plan", scan_only->plan,
                   "the *.plan.json beside the printed G-code; left out: that of the last pattern "
                   "that trammel printed there");
  scan->add_option("--pattern", scan_only->only,
                   "scan only this one of several, counted from 0; left out: all")
      ->check(CLI::Range(0, 9999));
}

}  // namespace trammel::app

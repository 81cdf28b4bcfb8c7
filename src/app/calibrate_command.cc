// trammel pa calibrate, and its halves trammel pa print and trammel pa scan.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "app/analysis_output.h"
#include "app/analysis_run.h"
#include "app/apply_command.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "pressure_advance/pattern.h"
#include "pressure_advance/pattern_plan.h"
#include "procedure/calibrate.h"
#include "procedure/sweep_plan.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct CalibrateArguments {
  PrinterOptions printer;
  std::string out;
  bool print = true;
  bool scan = true;
  bool apply = false;
  bool dry_run = false;
  bool json = false;
};

Result<void> DryRun(const store::Config& config) {
  auto pattern = config.pattern;
  pattern.finish = pressure_advance::Finish::kIdle;  // as it is printed: the scan follows
  const auto layout = LayOut(pattern);
  procedure::Reach reach;
  reach.minimum_mm = {pattern.bed_origin_x_mm, pattern.bed_origin_y_mm, 0};
  reach.maximum_mm = {pattern.bed_origin_x_mm + pattern.bed_size_x_mm,
                      pattern.bed_origin_y_mm + pattern.bed_size_y_mm, 1000};
  const auto sweeps =
      procedure::PlanSweeps(MakePlan(layout, pattern, "pattern.gcode"), 0, config.scan, reach);
  if (!sweeps) return tl::unexpected(sweeps.error());
  fmt::print("; --- print ---\n{}; --- scan, about {:.0f} s ---\n{}", WriteGcode(layout, pattern),
             sweeps->time_s(), DescribeSweeps(*sweeps, config.scan, pattern.travel_speed_mm_s));
  return {};
}

// Analyses, reports, and applies where asked to.
int Conclude(const CalibrateArguments& arguments, const procedure::Session& session,
             const fs::path& folder) {
  const auto run = AnalyseRecording(folder, pressure_advance::Method::kResponse);
  if (!run) return Report(run.error());
  AnalysisOutput output;
  output.report = (folder / "report.html").string();
  output.json = arguments.json;
  const int code = PrintAnalysis(*run, folder.string(), output);
  const Measured& measured = run->analysis.pressure_advance;
  if (!measured.good()) return code;
  const double value_s = measured.quantity().value;
  if (arguments.apply) {
    const auto done = Apply(session, value_s, arguments.json);
    return done ? code : Report(done.error());
  }
  if (!arguments.json) {
    fmt::print("nothing applied   trammel pa apply {}\n", folder.string());
    ExplainKeeping(value_s);
  }
  return code;
}

int RunCalibration(const CalibrateArguments& arguments) {
  const Interrupt interrupt;
  const auto config = LoadSettings(arguments.printer);
  if (!config) return Report(config.error());
  if (arguments.dry_run) {
    const auto done = DryRun(*config);
    return done ? static_cast<int>(kExitGood) : Report(done.error());
  }
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return Report(printer.error());
  const auto folder = MakeFolder(arguments.out);
  if (!folder) return Report(folder.error());
  const procedure::Session session{**printer, interrupt.token(), TellOnTerminal};
  procedure::CalibrationRequest request;
  request.pattern = config->pattern;
  request.settings = config->scan;
  request.folder = *folder;
  request.started = Now("{:%Y-%m-%dT%H:%M:%S}");
  request.print = arguments.print;
  request.scan = arguments.scan;
  const procedure::CalibrationOutcome outcome = Calibrate(session, request);
  for (const std::string& failure : outcome.unrestored) {
    fmt::print(stderr, "trammel: NOT AS IT WAS: {}\n", failure);
  }
  if (!outcome.done) {
    std::error_code ignored;
    if (!fs::is_empty(*folder, ignored)) {
      fmt::print(stderr, "trammel: what was recorded so far is in {}\n", folder->string());
    }
    return Report(outcome.done.error());
  }
  if (!outcome.unrestored.empty()) return kExitMachine;
  if (arguments.scan) return Conclude(arguments, session, *folder);
  fmt::print("printed; scan it with: trammel pa scan\n");
  return kExitGood;
}

void AddStep(CLI::App& parent, int& exit_code, const char* name, const char* text, bool print,
             bool scan) {
  CLI::App* command = parent.add_subcommand(name, text);
  const auto arguments = std::make_shared<CalibrateArguments>();
  arguments->print = print;
  arguments->scan = scan;
  AddPrinterOptions(*command, arguments->printer);
  AddCameraOption(*command, arguments->printer);
  command->add_option("--out", arguments->out, "new folder for everything that is recorded");
  command->add_flag("--dry-run", arguments->dry_run, "print the G-code and the sweeps, do nothing");
  command->add_flag("--json", arguments->json, "print the answer as one JSON object");
  if (scan) {
    command->add_flag("--apply", arguments->apply, "set the answer on the printer if it is good");
  }
  command->callback([arguments, &exit_code] { exit_code = RunCalibration(*arguments); });
}

}  // namespace

void AddCalibrateCommands(CLI::App& parent, int& exit_code) {
  AddStep(parent, exit_code, "calibrate", "print the pattern, scan it, and say the answer", true,
          true);
  AddStep(parent, exit_code, "print", "print the pattern and leave it warm on the bed", true,
          false);
  AddStep(parent, exit_code, "scan", "scan a pattern that is on the bed, and say the answer", false,
          true);
}

}  // namespace trammel::app

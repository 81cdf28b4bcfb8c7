// trammel pa calibrate|print|scan|apply and trammel doctor: what needs a printer.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/analysis_output.h"
#include "app/analysis_run.h"
#include "app/commands.h"
#include "app/config_text.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "machine/moonraker_printer.h"
#include "pressure_advance/pattern.h"
#include "pressure_advance/pattern_plan.h"
#include "procedure/calibrate.h"
#include "procedure/checks.h"
#include "procedure/frame_recorder.h"
#include "procedure/sweep_plan.h"
#include "store/config_file.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct PrinterArguments {
  std::string config;
  std::vector<std::string> set;
  std::string address;
  std::string camera;
  std::string out;
  std::string value;  // of pa apply
  bool apply = false;
  bool dry_run = false;
  bool json = false;
};

Result<store::Config> Load(const PrinterArguments& arguments) {
  const Result<ConfigText> text = FindConfig(arguments.config);
  if (!text) return tl::unexpected(text.error());
  Result<store::Config> config = store::ParseConfig(text->text, text->file);
  if (!config) return config;
  for (const std::string& assignment : arguments.set) {
    if (auto done = store::OverrideConfig(assignment, *config); !done) {
      return tl::unexpected(done.error());
    }
  }
  if (auto valid = store::ValidateConfig(*config, text->text, text->file); !valid) {
    return tl::unexpected(valid.error());
  }
  if (!arguments.address.empty()) config->scan.address = arguments.address;
  if (!arguments.camera.empty()) config->scan.camera = arguments.camera;
  return config;
}

Result<std::unique_ptr<machine::Printer>> Connect(const pressure_advance::ScanSettings& settings,
                                                  const std::stop_token& stop) {
  machine::MoonrakerOptions options;
  options.address = settings.address;
  if (!settings.http_address.empty()) options.http_address = settings.http_address;
  options.api_key = settings.api_key;
  options.ca_file = settings.ca_file;
  options.accept_any_certificate = settings.accept_any_certificate;
  return machine::ConnectToMoonraker(options, {options.connect_time_limit_s, stop});
}

std::string Now(const char* format) {
  return fmt::format(fmt::runtime(format), fmt::localtime(std::time(nullptr)));
}

Result<fs::path> MakeFolder(const std::string& asked_for) {
  const fs::path folder =
      asked_for.empty() ? fs::path("recordings") / Now("pa-{:%Y%m%d-%H%M%S}") : fs::path(asked_for);
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    return Fail(
        fmt::format("--out {}: is there and not empty; recordings are never overwritten: "
                    "choose another name",
                    folder.string()));
  }
  fs::create_directories(folder, error);
  if (error) {
    return Fail(
        fmt::format("--out {}: cannot make the folder: {}", folder.string(), error.message()));
  }
  return folder;
}

// Progress goes to standard error: standard output holds the answer alone.
void Tell(const procedure::Progress& progress) {
  if (progress.remaining_s) {
    fmt::print(stderr, "  {} (about {:.0f} s)\n", progress.text, *progress.remaining_s);
  } else {
    fmt::print(stderr, "  {}\n", progress.text);
  }
}

Result<void> DryRun(const store::Config& config) {
  const auto& pattern = config.pattern;
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

Result<double> Answer(const fs::path& folder) {
  const auto run = AnalyseRecording(folder, pressure_advance::Method::kResponse);
  if (!run) return tl::unexpected(run.error());
  const Measured& measured = run->analysis.pressure_advance;
  if (measured.good()) return measured.quantity().value;
  return Fail(fmt::format("{}: nothing is applied, because the verdict is {}: {}", folder.string(),
                          ToString(measured.verdict()), measured.reason()),
              ErrorKind::kMeasurement);
}

void ExplainKeeping(double value_s) {
  fmt::print("to keep it        add to [extruder] in printer.cfg:  pressure_advance: {:.4f}\n",
             value_s);
}

// Analyses, reports, and applies where asked to.
int Conclude(const PrinterArguments& arguments, const procedure::Session& session,
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
  if (!arguments.apply) {
    if (!arguments.json) {
      fmt::print("nothing applied   trammel pa apply {}\n", folder.string());
      ExplainKeeping(value_s);
    }
    return code;
  }
  if (auto done = ApplyPressureAdvance(session, value_s); !done) return Report(done.error());
  if (!arguments.json) {
    fmt::print("applied           SET_PRESSURE_ADVANCE ADVANCE={:.4f}, until the next restart\n",
               value_s);
    ExplainKeeping(value_s);
  }
  return code;
}

int RunCalibration(const PrinterArguments& arguments, bool print, bool scan) {
  const Interrupt interrupt;
  const auto config = Load(arguments);
  if (!config) return Report(config.error());
  if (arguments.dry_run) {
    const auto done = DryRun(*config);
    return done ? static_cast<int>(kExitGood) : Report(done.error());
  }
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return Report(printer.error());
  const auto folder = MakeFolder(arguments.out);
  if (!folder) return Report(folder.error());
  const procedure::Session session{**printer, interrupt.token(), Tell};
  procedure::CalibrationRequest request;
  request.pattern = config->pattern;
  request.settings = config->scan;
  request.folder = *folder;
  request.started = Now("{:%Y-%m-%dT%H:%M:%S}");
  request.print = print;
  request.scan = scan;
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
  if (scan) return Conclude(arguments, session, *folder);
  fmt::print("printed; scan it with: trammel pa scan\n");
  return kExitGood;
}

Result<double> ParseValue(const std::string& text) {
  const auto values = ParsePressureAdvances(text);
  if (!values) return Fail(values.error().message);
  if (values->size() == 1) return values->front();
  return Fail(fmt::format("{}: must be one pressure advance in s, or a recording's folder", text));
}

int RunApply(const PrinterArguments& arguments) {
  const Interrupt interrupt;
  const auto config = Load(arguments);
  if (!config) return Report(config.error());
  std::error_code ignored;
  const Result<double> value = fs::is_directory(arguments.value, ignored)
                                   ? Answer(arguments.value)
                                   : ParseValue(arguments.value);
  if (!value) return Report(value.error());
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return Report(printer.error());
  const procedure::Session session{**printer, interrupt.token(), Tell};
  if (auto done = ApplyPressureAdvance(session, *value); !done) return Report(done.error());
  fmt::print("applied           SET_PRESSURE_ADVANCE ADVANCE={:.4f}, until the next restart\n",
             *value);
  ExplainKeeping(*value);
  return kExitGood;
}

procedure::Check CheckCamera(const procedure::Session& session,
                             const pressure_advance::ScanSettings& settings) {
  auto camera = OpenCamera(session, settings);
  if (!camera) return {"camera", false, camera.error().message};
  procedure::FrameRecorder recorder(**camera, 5);
  const auto frame = recorder.NextFrame(5, session.stop);
  if (!frame) return {"camera", false, frame.error().message};
  return {"camera", true, (*camera)->Describe()};
}

int RunDoctor(const PrinterArguments& arguments) {
  const Interrupt interrupt;
  const auto config = Load(arguments);
  if (!config) return Report(config.error());
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return Report(printer.error());
  const procedure::Session session{**printer, interrupt.token(), Tell};
  auto checks = CheckPrinter(session, config->pattern, config->scan);
  checks.push_back(CheckCamera(session, config->scan));
  checks.push_back(procedure::CheckDisk(fs::current_path(), 60, config->scan.frames_per_s));
  bool all = true;
  for (const procedure::Check& check : checks) {
    fmt::print("{}  {:<24} {}\n", check.passed ? "ok " : "FIX", check.name, check.detail);
    all = all && check.passed;
  }
  return all ? kExitGood : kExitMachine;
}

void AddCommon(CLI::App& command, PrinterArguments& arguments) {
  command.add_option("--config", arguments.config,
                     "settings; left out: trammel.toml of this folder, if there is one");
  command.add_option("--set", arguments.set, "one setting: key=value; may be repeated");
  command.add_option("--printer", arguments.address,
                     "Moonraker's address: host, host:port, URL or unix:PATH");
}

void AddRecording(CLI::App& command, PrinterArguments& arguments) {
  command.add_option("--camera", arguments.camera,
                     "stream URL, /dev/videoN, video file or folder of pictures");
  command.add_option("--out", arguments.out, "new folder for everything that is recorded");
  command.add_flag("--dry-run", arguments.dry_run, "print the G-code and the sweeps, do nothing");
  command.add_flag("--json", arguments.json, "print the answer as one JSON object");
}

}  // namespace

void AddPrinterCommands(CLI::App& cli, CLI::App& pa, int& exit_code) {
  struct Step {
    const char* name;
    const char* text;
    bool print;
    bool scan;
  };
  for (const Step& step :
       {Step{"calibrate", "print the pattern, scan it, and say the pressure advance", true, true},
        Step{"print", "print the pattern and leave it warm on the bed", true, false},
        Step{"scan", "scan a pattern that is on the bed, and say the pressure advance", false,
             true}}) {
    CLI::App* command = pa.add_subcommand(step.name, step.text);
    const auto arguments = std::make_shared<PrinterArguments>();
    AddCommon(*command, *arguments);
    AddRecording(*command, *arguments);
    if (step.scan) {
      command->add_flag("--apply", arguments->apply, "set the answer on the printer if it is good");
    }
    command->callback([arguments, step, &exit_code] {
      exit_code = RunCalibration(*arguments, step.print, step.scan);
    });
  }
  CLI::App* apply = pa.add_subcommand("apply", "set a pressure advance on the printer");
  const auto apply_arguments = std::make_shared<PrinterArguments>();
  apply->add_option("value", apply_arguments->value, "seconds, or a recording's folder")
      ->required();
  AddCommon(*apply, *apply_arguments);
  apply->callback([apply_arguments, &exit_code] { exit_code = RunApply(*apply_arguments); });

  CLI::App* doctor = cli.add_subcommand("doctor", "check the whole set-up and say what to fix");
  const auto doctor_arguments = std::make_shared<PrinterArguments>();
  AddCommon(*doctor, *doctor_arguments);
  doctor->add_option("--camera", doctor_arguments->camera, "as for pa calibrate");
  doctor->callback([doctor_arguments, &exit_code] { exit_code = RunDoctor(*doctor_arguments); });
}

}  // namespace trammel::app

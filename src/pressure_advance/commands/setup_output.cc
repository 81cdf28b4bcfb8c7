#include "pressure_advance/commands/setup_output.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/config/config_file.h"
#include "app/interrupt.h"
#include "app/kept_history.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "base/json_text.h"
#include "document/interval_text.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "measurement/outcome.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/procedure/setup.h"
#include "pressure_advance/report/analysis_json.h"
#include "pressure_advance/setup/printed_mark.h"
#include "session/crash_recovery.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using procedure::SetupRecord;

constexpr const char* kSection = "camera.toml";

report::SetupView ViewOfSetup(const SetupRecord& record, const SetupOutput& output) {
  report::SetupView view;
  view.seen = &record.seen;
  view.result = &record.result;
  view.mark = &record.mark;
  view.advice = AdviseSetup(record.result, record.seen.picture);
  view.facts = {{"program", std::string(ProgramVersion())},
                {"utc", UtcNow()},
                {"printer", output.printer},
                {"camera", record.camera}};
  if (record.result.verdict() == Verdict::kGood) {
    view.section = files::FormatCameraSection(record.result, record.seen.height_mm);
  }
  return view;
}

Result<void> WriteSetupFiles(const report::SetupView& view, const fs::path& folder) {
  std::vector<OutputFile> outputs = {{folder / "setup.json", JsonText(JsonOfSetup(view))}};
  if (!view.section.empty()) outputs.push_back({folder / kSection, view.section});
  return WriteOutputs(outputs, false);
}

void PrintSetupText(const SetupRecord& record, const report::SetupView& view) {
  const auto& result = record.result;
  bool all = true;
  const auto values = report::SetupValues(result);
  const bool any = std::any_of(values.begin(), values.end(),
                               [](const auto& value) { return value.value->good(); });
  for (const auto& value : values) {
    if (!any) break;  // the verdict says it once
    const Measured& measured = *value.value;
    // The reason of all values that a scan needs is printed once, below.
    if (measured.good()) {
      fmt::print("{:<17} {}\n", value.name, WithInterval(measured.quantity(), value.style));
    } else {
      fmt::print("{:<17} {}\n", value.name, VerdictText(measured.verdict()));
      all = false;
    }
  }
  if (const auto& crop = result.crop) {
    fmt::print("crop              {}x{} px at ({}, {})\n", crop->width, crop->height, crop->x,
               crop->y);
  }
  if (view.advice.threshold) {
    fmt::print("threshold         red above {} of 255\n", *view.advice.threshold);
  }
  if (result.check_mm) {
    fmt::print("trial             the mark came to {:.3f} mm from the laser\n", *result.check_mm);
  }
  for (const std::string& line : view.advice.lines) fmt::print("advice            {}\n", line);
  fmt::print("verdict           {}\n", VerdictText(result.verdict()));
  if (!(any && all) && !result.reason().empty())
    fmt::print("because           {}\n", result.reason());
}

}  // namespace

Result<CameraTarget> ReadCameraTarget(const fs::path& path) {
  if (auto free = files::CheckTarget(path, files::IfThere::kReplace); !free) {
    return Fail(fmt::format("--write {}", free.error().message), free.error().kind);
  }
  CameraTarget target{path, {}};
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return target;
  auto text = TRY(files::ReadWholeFile(path, files::kMaxConfigBytes));
  TRY(files::ParseConfig(text, path.string()));
  // Tests that its [camera] can be written before anything is heated.
  constexpr double kTried_mm = 12.5;
  const auto tried =
      files::ParseConfig(files::PutCameraKeys(text, {{"offset_x", "12.5"}}), path.string());
  if (!tried || tried->scan.camera_offset_x_mm != kTried_mm) {
    return Fail(
        fmt::format("--write {}: its section [camera] is spelled in a way that is not "
                    "understood: write it as [camera] with a line for each key",
                    path.string()));
  }
  target.text = std::move(text);
  return target;
}

namespace {

// Keeps a file readable by its owner only, if it was so before: it may contain keys.
files::Readable ReadableAs(const fs::path& path) {
  std::error_code error;
  const fs::perms perms = fs::status(path, error).permissions();
  constexpr fs::perms kOthers = fs::perms::group_read | fs::perms::others_read;
  return !error && (perms & kOthers) == fs::perms::none ? files::Readable::kByOwner
                                                        : files::Readable::kByUmask;
}

bool Holds(const settings::ScanSettings& read, const pressure_advance::SetupResult& result) {
  constexpr double kRounding = 1e-3;  // of the output: micrometres, hundredths of a degree
  const auto same = [](double a, double b) { return a - b < kRounding && b - a < kRounding; };
  return same(read.camera_offset_x_mm, result.offset.x_mm.quantity().value) &&
         same(read.camera_offset_y_mm, result.offset.y_mm.quantity().value) && read.px_per_mm &&
         same(*read.px_per_mm, result.scale.px_per_mm.quantity().value);
}

}  // namespace

Result<std::string> WriteCameraTarget(const CameraTarget& target,
                                      const pressure_advance::SetupResult& result,
                                      double focus_height_mm) {
  const std::string text =
      files::PutCameraKeys(target.text.value_or(""), files::CameraKeysOf(result, focus_height_mm));
  const auto read = files::ParseConfig(text, target.path.string());
  if (!read || !Holds(read->scan, result)) {
    return Fail(
        fmt::format("--write {}: its section [camera] is spelled in a way that is not "
                    "understood{}; nothing was changed: copy the lines by hand",
                    target.path.string(), read ? "" : " (" + read.error().message + ")"));
  }
  std::error_code ignored;
  if (!target.text) {
    TRY(files::WriteWholeFile(target.path, text, files::IfThere::kRefuse));
    return std::string();
  }
  const auto now = files::ReadWholeFile(target.path, files::kMaxConfigBytes);
  if (!now || *now != *target.text) {
    return Fail(
        fmt::format("--write {}: the file was changed while the camera was set up; "
                    "nothing was written: copy the lines by hand",
                    target.path.string()));
  }
  const files::Readable readable = ReadableAs(target.path);
  const std::string backup = fmt::format("{}.before-{}", target.path.string(), UtcNow());
  TRY(files::WriteWholeFile(backup, *target.text, files::IfThere::kRefuse, readable));
  TRY(files::WriteWholeFile(target.path, text, files::IfThere::kReplace, readable));
  return backup;
}

namespace {

// Collects the values that a scan needs, and the other good ones.
measurement::Outcome OutcomeOfSetup(const pressure_advance::SetupResult& result,
                                    const SetupOutput& output) {
  measurement::Outcome outcome;
  outcome.provenance =
      ProvenanceOf(measurement::Instrument::kCameraSetup, {output.folder.string()});
  outcome.subject.printer = output.printer;
  outcome.answers = {{"offset_x", "mm", result.offset.x_mm},
                     {"offset_y", "mm", result.offset.y_mm},
                     {"focus_height", "mm", result.focus_mm},
                     {"scale", "px/mm", result.scale.px_per_mm},
                     {"height_scale", "px/mm", result.height.px_per_height_mm},
                     {"scan_angle", "rad", result.scan_angle_rad}};
  for (const auto& [name, unit, value] :
       {std::tuple{"camera_rotation", "rad", &result.scale.rotation_rad},
        std::tuple{"laser_rotation", "rad", &result.laser_turn_rad},
        std::tuple{"play_x", "mm", &result.scale.backlash_x_mm},
        std::tuple{"play_y", "mm", &result.scale.backlash_y_mm},
        std::tuple{"play_z", "mm", &result.height.backlash_z_mm}}) {
    if (value->good()) outcome.answers.push_back({name, unit, *value});
  }
  return outcome;
}

}  // namespace

int PrintSetup(const SetupRecord& record, const SetupOutput& output) {
  const report::SetupView view = ViewOfSetup(record, output);
  const measurement::Outcome outcome = OutcomeOfSetup(record.result, output);
  // Prints the answer even if files failed.
  auto kept = WriteSetupFiles(view, output.folder);
  if (kept) kept = KeepInRecording(output.folder, {outcome, nullptr});
  const bool good = record.result.verdict() == Verdict::kGood;
  if (output.json) {
    std::fputs(JsonText(JsonOfSetup(view)).c_str(), stdout);
  } else {
    PrintSetupText(record, view);
    PrintDrift(fs::absolute(output.folder).parent_path(), outcome);
    if (good) fmt::print("\n{}", view.section);
  }
  if (!kept) return PrintError(kept.error());
  if (!good) return kExitNotTrusted;
  if (!output.target) {
    if (!output.json) {
      fmt::print("\nnothing changed   {} has these lines; they go into trammel.toml\n",
                 (output.folder / kSection).string());
    }
    return kExitGood;
  }
  const auto backup = WriteCameraTarget(*output.target, record.result, record.seen.height_mm);
  if (!backup) return PrintError(backup.error());
  if (!output.json) {
    fmt::print("\nwritten           {}{}\n", output.target->path.string(),
               backup->empty() ? "" : "; as it was before: " + *backup);
  }
  return kExitGood;
}

namespace {

struct SetupArguments {
  PrinterOptions printer;
  std::string out;
  std::string write;
  std::vector<double> clear_z;
  std::vector<double> mark_at;
  bool dry_run = false;
  bool json = false;
};

procedure::SetupRequest SetupRequestOf(const SetupArguments& arguments,
                                       const files::Config& config) {
  const auto run = RequestFor(config, {});
  procedure::SetupRequest request;
  request.pattern = run.pattern;
  request.settings = run.settings;
  request.identity = run.identity;
  request.clear = {arguments.clear_z.at(0), arguments.clear_z.at(1)};
  if (!arguments.mark_at.empty()) {
    request.mark = {arguments.mark_at.at(0), arguments.mark_at.at(1)};
  }
  return request;
}

// Prints the mark's G-code and the head's positions, independent of a printer.
Result<void> PrintSetupDryRun(const procedure::SetupRequest& request) {
  TRY(settings::ValidateTemperatures(request.pattern));
  constexpr double kFar_mm = 2000;  // a printer says how far it reaches, and none is asked
  procedure::Reach anywhere;
  anywhere.minimum_mm.fill(-kFar_mm);
  anywhere.maximum_mm.fill(kFar_mm);
  TRY(CheckClearHeights(request.clear, request.settings, anywhere));
  const auto mark = TRY(PlanMark(request.pattern, request.mark, request.settings.camera_offset_x_mm,
                                 request.settings.camera_offset_y_mm));
  fmt::print("; --- print ---\n{}", WriteMarkGcode(mark, request.pattern));
  const double x_mm = mark.x_mm - request.settings.camera_offset_x_mm;
  const double y_mm = mark.y_mm - request.settings.camera_offset_y_mm;
  fmt::print(
      "; --- looks ---\n; mark at ({:.1f}, {:.1f}) mm; the nozzle goes from {:.4g} to {:.4g} mm, "
      "about ({:.1f}, {:.1f}) mm and beside it\n",
      mark.x_mm, mark.y_mm, request.clear.low_mm, request.clear.high_mm, x_mm, y_mm);
  return {};
}

Result<int> RunSetup(const SetupArguments& arguments) {
  const Interrupt interrupt;
  auto config = TRY(LoadSettings(arguments.printer));
  auto request = SetupRequestOf(arguments, config);
  TRY(settings::ValidateTemperatures(request.pattern));
  if (arguments.dry_run) {
    TRY(PrintSetupDryRun(request));
    return kExitGood;
  }
  SetupOutput output;
  output.json = arguments.json;
  output.printer = procedure::PrinterName(config.scan.address);
  if (!arguments.write.empty()) {
    output.target = TRY(ReadCameraTarget(arguments.write));
  }
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  TRY(FitPattern(session, config));
  request.pattern = config.pattern;
  const auto folder = TRY(NewFolder::Make(
      arguments.out.empty()
          ? fs::path("recordings") / RecordingName(measurement::Instrument::kCameraSetup)
          : fs::path(arguments.out)));
  output.folder = request.folder = folder.path();
  const auto outcome = SetUpCamera(session, request);
  const auto done =
      ReportEnd(outcome.done, outcome.unrestored, request.folder, "the pictures so far are in");
  if (!outcome.done) return tl::unexpected(done.error());
  const int code = PrintSetup(outcome.record, output);
  if (!done) return tl::unexpected(done.error());
  return code;
}

}  // namespace

void AddSetupCommand(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<SetupArguments>();
  CLI::App* setup = parent.add_subcommand(
      "setup", "measure how laser and camera sit on the head, by the printer's own motion");
  AddPrinterOptions(*setup, arguments->printer);
  AddCameraOption(*setup, arguments->printer);
  AddMaterialOption(*setup, arguments->printer.material);
  setup
      ->add_option("--clear-z", arguments->clear_z,
                   "LOW,HIGH in mm: heights of the nozzle between which you have seen that nothing "
                   "on the head touches anything")
      ->delimiter(',')
      ->expected(2)
      ->required();
  setup
      ->add_option("--mark-at", arguments->mark_at,
                   "X,Y in mm: where the mark is printed; left out: so that mark and head lie "
                   "about the bed's middle")
      ->delimiter(',')
      ->expected(2);
  setup->add_option("-o,--out", arguments->out, "new folder for pictures, values and report");
  setup->add_option("--write", arguments->write,
                    "a trammel.toml that receives the values; left out: they are printed alone");
  setup->add_flag("--json", arguments->json, "print the answer as one JSON object");
  setup->add_flag("--dry-run", arguments->dry_run,
                  "print the mark's G-code and where the head goes, do nothing");
  setup->callback([arguments, &exit_code] { exit_code = CodeOf(RunSetup(*arguments)); });
}

}  // namespace trammel::app

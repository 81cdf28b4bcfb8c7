#include "pressure_advance/procedure/calibrate.h"

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <utility>

#include "base/utf8.h"
#include "files/new_file.h"
#include "machine/moonraker/webcam_list.h"
#include "machine/net/json_field.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/procedure/scan.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "session/checks.h"
#include "session/print.h"
#include "settings/material.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using settings::ScanSettings;

constexpr double kAsk_s = 10;
constexpr std::size_t kMaxPhotoBytes = std::size_t{64} << 20;
constexpr double kStall_s = 5;
constexpr std::size_t kLongestCameraName = 500;
constexpr int kJpegQuality = 95;  // for pictures received as raw pixels

ParkPlace ParkPlaceOf(const PatternConfig& config) {
  const auto park = settings::ParkPositionOf(config);
  return {config.park_lift_mm, park.x_mm, park.y_mm, config.z_speed_mm_s, config.travel_speed_mm_s};
}

// Opens a camera that delivers pictures; empty if none is wanted.
Result<OpenedCamera> OpenReaderCamera(const Session& session, const GuardedRun& run) {
  OpenedCamera reader;
  if (!run.looks) return reader;
  session.Report({.text = "looking at the camera", .remaining_s = {}, .phase = "checking"});
  reader.camera = TRY(OpenCamera(session, *run.settings));
  reader.recorder = std::make_unique<FrameRecorder>(*reader.camera, kStall_s);
  TRY(reader.recorder->NextFrame(kStall_s, session.stop));
  return reader;
}

}  // namespace

std::string OpenedCamera::Describe() const {
  return camera ? Utf8OrReplaced(camera->Describe(), kLongestCameraName) : std::string();
}

GuardedOutcome RunGuarded(Session& session, const GuardedRun& run) {
  OpenedCamera reader;  // open until the laser is off
  GuardedSteps guarded;
  guarded.settings = run.settings;
  guarded.identity = run.identity;
  guarded.park = ParkPlaceOf(*run.pattern);
  guarded.check = run.check;
  guarded.steps = [&](const Session& taken, PrinterStateGuard& guard) -> Result<void> {
    reader = TRY(OpenReaderCamera(taken, run));
    TRY(HomeWhereItIsNot(taken));
    TRY(guard.Begin(taken));
    return run.steps(taken, guard, reader);
  };
  return RunGuarded(session, guarded);
}

Result<std::unique_ptr<machine::FrameSource>> OpenCamera(const Session& session,
                                                         const ScanSettings& settings) {
  machine::CameraOptions options;
  options.width_px = settings.frame_width_px;
  options.height_px = settings.frame_height_px;
  options.frames_per_s = settings.frames_per_s;
  options.jpeg_quality = kJpegQuality;
  if (!settings.camera.empty()) return machine::OpenCamera(settings.camera, options, session.stop);
  const auto webcams = TRY(session.printer.Webcams(session.Within(kAsk_s)));
  const auto webcam = TRY(machine::ChooseWebcam(webcams, settings.webcam));
  return machine::OpenCamera(webcam.stream_url, options, session.stop);
}

Result<void> CoolForScan(const Session& session, const machine::PrinterState& state,
                         double nozzle_c, double time_limit_s) {
  const std::string& extruder = state.active_extruder;
  if (nozzle_c == 0) {
    session.Report(fmt::format("switching {} off, without waiting for it to cool", extruder));
    return SetTarget(session, extruder, 0);
  }
  const auto nozzle = state.heaters.find(extruder);
  const bool cold = nozzle != state.heaters.end() && nozzle->second.temperature_c <= nozzle_c &&
                    nozzle->second.target_c <= nozzle_c;
  return cold ? Result<void>{} : CoolAndWait(session, extruder, nozzle_c, time_limit_s);
}

namespace {

using nlohmann::json;

/// Finds the last of the folder's own pictures, without its bytes.
Result<PatternPhoto> NewestPhoto(const Session& session,
                                 const std::function<bool(const std::string&)>& is_result) {
  auto photos = ListUploads(session, [&is_result](const std::string& name) {
    return !PictureEnding(name).empty() && !is_result(name);
  });
  if (!photos) return tl::unexpected(photos.error());
  if (!photos->empty()) {
    UploadedFile& newest = photos->back();
    PatternPhoto photo{std::move(newest.name), {}};
    if (newest.modified_s > 0) photo.stored_s = newest.modified_s;
    return photo;
  }
  return Fail(
      fmt::format("there is no photo in the folder {} beside the printer's configuration: upload "
                  "one there (JPEG, PNG, WebP or HEIC)",
                  kUploadFolder));
}

}  // namespace

std::optional<double> ServerTime_s(const Session& session) {
  constexpr double kReport_s =
      3;  // also where somebody stops the program: of a print that has ended
  const auto told = session.printer.CallServer("machine.proc_stats", nullptr, {kReport_s, {}});
  const json* const times = told ? machine::Member(*told, "moonraker_stats") : nullptr;
  if (times == nullptr || !times->is_array() || times->empty()) return std::nullopt;
  return machine::Number(times->back(), "time");
}

std::string PictureEnding(const std::string& name) {
  constexpr std::array<std::string_view, 6> kEndings = {".jpg",  ".jpeg", ".png",
                                                        ".webp", ".heic", ".heif"};
  return EndingAmong(kEndings, name);
}

Result<PatternPhoto> DownloadPhoto(const Session& session, const std::string& name,
                                   const std::function<bool(const std::string&)>& is_result) {
  PatternPhoto photo{name, {}};
  if (name.empty()) {
    photo = TRY(NewestPhoto(session, is_result));
  } else if (PictureEnding(name).empty()) {
    return Fail(
        fmt::format("{}: must be the name of a picture (.jpg, .png, .webp, .heic) in the "
                    "folder {} beside the printer's configuration",
                    name, kUploadFolder));
  }
  photo.bytes = TRY(DownloadUpload(session, photo.name, kMaxPhotoBytes));
  return photo;
}

namespace {

using pressure_advance::PatternPlan;

constexpr double kHome_s = 300;
constexpr const char* kGcodeName = "pattern.gcode";
constexpr const char* kPlanName = "pattern.plan.json";

PatternPlan PlanOf(const CalibrationRequest& request, const PatternConfig& config) {
  return request.plan ? *request.plan : MakePlan(LayOut(config), config, kGcodeName);
}

// Returns the pattern for this printer: warm afterwards for a scan, and with its own values
// restored.
PatternConfig ForThisPrinter(PatternConfig config, const machine::PrinterState& before,
                             bool for_photo) {
  config.finish = for_photo ? pressure_advance::Finish::kEnd : pressure_advance::Finish::kIdle;
  if (const auto advance_s = machine::ActiveAdvance_s(before)) {
    config.restore_pressure_advance_s = advance_s;
  }
  if (before.limits.max_accel_mm_s2 > 0) {
    config.restore_acceleration_mm_s2 = before.limits.max_accel_mm_s2;
  }
  config.restore_minimum_cruise_ratio =
      before.limits.minimum_cruise_ratio.value_or(config.restore_minimum_cruise_ratio);
  return config;
}

Result<void> PrintPattern(const Session& session, const CalibrationRequest& request,
                          const PatternConfig& config, const PatternPlan& plan) {
  const auto layout = LayOut(config);
  const std::string gcode = WriteGcode(layout, config);
  TRY(files::WriteWholeFile(request.folder / kGcodeName, gcode, files::IfThere::kRefuse));
  if (request.folders.empty()) {  // else no plan is one of all
    TRY(files::WriteWholeFile(request.folder / kPlanName, files::FormatPlan(plan),
                              files::IfThere::kRefuse));
  }
  PrintOptions options;
  if (request.note_print) {
    options.before_start = [&] { return request.note_print(/*ended=*/false); };
  }
  options.heat_time_limit_s = request.settings.heat_time_limit_s;
  const auto summary = Summarise(layout, config);
  options.print_time_s = summary.time_s;
  options.filament_mm = summary.filament_mm;
  const auto temperatures = settings::TemperaturesOf(config);
  session.Report("to be heated to " + settings::DescribeTemperatures(config));
  options.nozzle_temperature_c = temperatures.nozzle_c;
  options.bed_temperature_c = temperatures.bed_c;
  return Print(session, gcode, options);
}

// Cleans the nozzle, and cools it until it does not ooze.
Result<void> PrepareNozzle(const Session& session, const ScanSettings& settings) {
  // The print may have taken longer than the printer's own limit.
  TRY(KeepAlive(session));
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  if (!settings.clean_nozzle_gcode.empty()) {
    TRY(CheckStillFree(session));
    TRY(RunNoted(session, settings.clean_nozzle_gcode, kHome_s));
    TRY(KeepAlive(session));
  }
  return CoolForScan(session, state, settings.scan_nozzle_temperature_c,
                     settings.heat_time_limit_s);
}

// Steps of a scan of any pattern.
struct Scanner {
  const Session& session;
  const CalibrationRequest& request;
  const PatternConfig& config;
  FrameRecorder& recorder;
  const std::string& camera;
  PrinterStateGuard& guard;
};

Result<SweepPlan> SweepsOf(const Scanner& scanner, const PatternPlan& plan) {
  const auto reach = TRY(ReachOf(scanner.session));
  return PlanSweeps(plan, scanner.request.only, scanner.request.settings, reach);
}

Result<void> SweepLines(const Scanner& scanner, const PatternPlan& plan, const SweepPlan& sweeps,
                        const std::filesystem::path& folder, bool laser_seen) {
  const CalibrationRequest& request = scanner.request;
  ScanRequest scan;
  scan.plan = plan;
  scan.settings = request.settings;
  scan.travel_speed_mm_s = scanner.config.travel_speed_mm_s;
  scan.z_speed_mm_s = scanner.config.z_speed_mm_s;
  scan.folder = folder;
  scan.started = request.identity.started;
  scan.camera = scanner.camera;
  scan.laser_seen = laser_seen;
  scanner.guard.ExpectLaser();
  return ScanLines(scanner.session, scanner.recorder, sweeps, scan);
}

Result<void> ScanPattern(const Scanner& scanner, const PatternPlan& plan) {
  const auto sweeps = TRY(SweepsOf(scanner, plan));
  auto ready = PrepareNozzle(scanner.session, scanner.request.settings);
  return ready ? SweepLines(scanner, plan, sweeps, scanner.request.folder, false) : ready;
}

// Makes one recording each. A pattern that cannot be assigned to its motion does not stop the
// others.
Result<void> ScanEachPattern(const Scanner& scanner) {
  const CalibrationRequest& request = scanner.request;
  const auto layout = LayOut(scanner.config);
  const std::string gcode = WriteGcode(layout, scanner.config);
  TRY(PrepareNozzle(scanner.session, request.settings));
  Result<void> failed;
  bool scanned = false;
  for (std::size_t i = 0; i < request.folders.size(); ++i) {
    const PatternPlan plan = PlanOfPattern(layout, scanner.config, static_cast<int>(i), kGcodeName);
    auto planned = files::WriteWholeFile(request.folders[i] / kPlanName, files::FormatPlan(plan),
                                         files::IfThere::kRefuse);
    if (planned) {
      planned =
          files::WriteWholeFile(request.folders[i] / kGcodeName, gcode, files::IfThere::kRefuse);
    }
    if (!planned) return planned;
    const auto sweeps = TRY(SweepsOf(scanner, plan));
    scanner.session.Report(fmt::format("scanning pattern {} of {}", i + 1, request.folders.size()));
    auto swept = SweepLines(scanner, plan, sweeps, request.folders[i], i > 0);
    if (!swept && swept.error().kind != ErrorKind::kMeasurement) return swept;
    scanned = scanned || swept.has_value();
    if (!swept) {
      scanner.session.Report(fmt::format("pattern {}: {}", i + 1, swept.error().message));
      failed = std::move(swept);
    }
  }
  return scanned ? Result<void>() : failed;
}

// Checks that each pattern's sweeps are within reach, and cover enough of its own speeds.
Result<void> CheckEachPattern(const Session& session, const CalibrationRequest& request) {
  if (request.folders.empty()) return {};
  const auto reach = TRY(ReachOf(session));
  const auto layout = LayOut(request.pattern);
  for (int pattern = 0; pattern < PatternCount(request.pattern); ++pattern) {
    TRY(PlanSweeps(PlanOfPattern(layout, request.pattern, pattern, kGcodeName), {},
                   request.settings, reach));
  }
  return {};
}

Result<void> CheckAll(const Session& session, const CalibrationRequest& request) {
  const CheckedPattern checked{request.pattern, request.plan, request.print};
  TRY(FirstFailure(request.for_photo ? CheckForPrint(session, checked)
                                     : CheckPrinter(session, checked, request.settings),
                   ErrorKind::kMachine));
  if (request.print) {
    TRY(settings::ValidateTemperatures(request.pattern));
  }
  if (!request.scan) return {};
  TRY(CheckEachPattern(session, request));
  const PatternPlan plan = PlanOf(request, request.pattern);
  const double record_s =
      static_cast<double>(plan.lines.size()) *
      (plan.line_length_mm / request.settings.scan_speed_mm_s + 2 * request.settings.settle_s);
  return FirstFailure({CheckDisk(request.folder, record_s, request.settings.frames_per_s)},
                      ErrorKind::kInput);
}

// Returns the printed file's target.
double BedTarget_c(const Session& session) {
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return 0;
  const auto bed = state->heaters.find("heater_bed");
  return bed == state->heaters.end() ? 0 : bed->second.target_c;
}

// A print loosens when the bed cools. The printer's own idle time-out still ends it.
Result<void> KeepBedWarm(const Session& session, double bed_c) {
  if (bed_c <= 0) return {};
  return SetTarget(session, "heater_bed", bed_c);
}

Result<void> RunSteps(const Session& session, const CalibrationRequest& request,
                      PrinterStateGuard& guard, FrameRecorder* recorder,
                      const std::string& camera) {
  PatternConfig config = ForThisPrinter(request.pattern, guard.before(), request.for_photo);
  if (request.print && request.scan) {
    const auto reach = TRY(ReachOf(session));
    config = ParkedForScan(config, request.settings, reach);
  }
  const PatternPlan plan = PlanOf(request, config);
  if (request.print) {
    auto printed = PrintPattern(session, request, config, plan);
    if (printed && request.note_print) printed = request.note_print(/*ended=*/true);
    if (!printed) return printed;
  }
  if (recorder == nullptr) return {};
  const Scanner scanner{session, request, config, *recorder, camera, guard};
  return request.folders.empty() ? ScanPattern(scanner, plan) : ScanEachPattern(scanner);
}

}  // namespace

CalibrationOutcome Calibrate(const Session& asked, const CalibrationRequest& request) {
  CalibrationOutcome outcome;
  Session session = asked;
  GuardedRun run;
  run.pattern = &request.pattern;
  run.settings = &request.settings;
  run.identity = request.identity;
  run.identity.prints = request.print;
  run.identity.without_laser = request.for_photo;
  run.identity.may_unhome = request.for_photo;
  run.identity.heaters_end_off = request.for_photo;
  run.looks = request.scan;
  run.check = [&](const Session& taken) { return CheckAll(taken, request); };
  run.steps = [&](const Session& taken, PrinterStateGuard& guard, const OpenedCamera& reader) {
    auto done = RunSteps(taken, request, guard, reader.recorder.get(), reader.Describe());
    if (done && !request.scan) outcome.bed_c = BedTarget_c(taken);
    return done;
  };
  static_cast<GuardedOutcome&>(outcome) = RunGuarded(session, run);
  if (outcome.done && outcome.unrestored.empty() && !request.scan) {
    outcome.done = KeepBedWarm(session, outcome.bed_c);
  }
  return outcome;
}

}  // namespace trammel::procedure

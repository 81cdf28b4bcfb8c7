#include "pressure_advance/procedure/calibrate.h"

#include <fmt/format.h>

#include "base/utf8.h"
#include "files/new_file.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/procedure/cool_for_scan.h"
#include "pressure_advance/procedure/scan.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "session/checks.h"
#include "session/dead_run.h"
#include "session/frame_recorder.h"
#include "session/name_stop.h"
#include "session/print.h"
#include "session/printer_state_guard.h"
#include "settings/material.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using pressure_advance::PatternPlan;
using settings::ScanSettings;

constexpr double kAsk_s = 10;
// Of pictures that a camera sends as raw pixels: recordings are MJPEG.
constexpr std::size_t kLongestCameraName = 500;
constexpr int kJpegQuality = 95;
constexpr double kHome_s = 300;
constexpr double kStall_s = 5;
constexpr const char* kGcodeName = "pattern.gcode";

PatternPlan PlanOf(const CalibrationRequest& request, const PatternConfig& config) {
  return request.plan ? *request.plan : MakePlan(LayOut(config), config, kGcodeName);
}

// The pattern as this printer will print it: warm afterwards, and with its own values restored.
PatternConfig ForThisPrinter(PatternConfig config, const machine::PrinterState& before) {
  config.finish = pressure_advance::Finish::kIdle;
  if (before.pressure_advance_s) config.restore_pressure_advance_s = before.pressure_advance_s;
  if (before.limits.max_accel_mm_s2 > 0) {
    config.restore_acceleration_mm_s2 = before.limits.max_accel_mm_s2;
  }
  config.restore_minimum_cruise_ratio =
      before.limits.minimum_cruise_ratio.value_or(config.restore_minimum_cruise_ratio);
  return config;
}

// Of a file that somebody else wrote: its lines, and as much again for travels and frames.
double RoughTime_s(const PatternPlan& plan) {
  double line_s = 0;
  for (const auto& segment : plan.segments) {
    line_s += segment.fraction * plan.line_length_mm / segment.speed_mm_s;
  }
  return 60 + 2 * line_s * static_cast<double>(plan.lines.size());
}

Result<void> PrintPattern(const Session& session, const CalibrationRequest& request,
                          const PatternConfig& config, const PatternPlan& plan) {
  const bool ours = request.gcode.empty();
  const auto layout = LayOut(config);
  const std::string gcode = ours ? WriteGcode(layout, config) : request.gcode;
  if (auto kept =
          files::WriteWholeFile(request.folder / kGcodeName, gcode, files::IfThere::kRefuse);
      !kept)
    return kept;
  auto planned = files::WriteWholeFile(request.folder / "pattern.plan.json",
                                       files::FormatPlan(plan), files::IfThere::kRefuse);
  if (!planned) return planned;
  PrintOptions options;
  options.heat_time_limit_s = request.settings.heat_time_limit_s;
  options.print_time_s = ours ? Summarise(layout, config).time_s : RoughTime_s(plan);
  if (ours) {
    const auto temperatures = settings::TemperaturesOf(config);
    session.Say("to be heated to " + settings::DescribeTemperatures(config));
    options.nozzle_temperature_c = temperatures.nozzle_c;
    options.bed_temperature_c = temperatures.bed_c;
  }
  return Print(session, gcode, options);
}

Result<void> SweepLines(const Session& session, const CalibrationRequest& request,
                        const PatternConfig& config, const PatternPlan& plan,
                        FrameRecorder& recorder, const std::string& camera,
                        PrinterStateGuard& guard) {
  // What was printed may have taken longer than the printer's own limit.
  if (auto told = KeepAlive(session); !told) return told;
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return tl::unexpected(state.error());
  const auto sweeps = PlanSweeps(plan, request.only, request.settings, ReachOf(*state));
  if (!sweeps) return tl::unexpected(sweeps.error());
  if (!request.settings.clean_nozzle_gcode.empty()) {
    if (auto free = CheckStillFree(session); !free) return free;
    auto clean = session.printer.Run(request.settings.clean_nozzle_gcode, session.Within(kHome_s));
    if (clean) clean = KeepAlive(session);
    if (!clean) return clean;
  }
  auto cool = CoolForScan(session, *state, request.settings.scan_nozzle_temperature_c,
                          request.settings.heat_time_limit_s);
  if (!cool) return cool;
  ScanRequest scan;
  scan.plan = plan;
  scan.settings = request.settings;
  scan.travel_speed_mm_s = config.travel_speed_mm_s;
  scan.z_speed_mm_s = config.z_speed_mm_s;
  scan.folder = request.folder;
  scan.started = request.started;
  scan.camera = camera;
  scan.cutter = request.cutter;
  guard.ExpectLaser();
  return ScanLines(session, recorder, *sweeps, scan);
}

Result<void> CheckAll(const Session& session, const CalibrationRequest& request) {
  auto printer = FirstFailure(
      CheckPrinter(session, request.pattern, request.settings, request.plan), ErrorKind::kMachine);
  if (!printer) return printer;
  if (request.print && request.gcode.empty()) {
    if (auto told = settings::ValidateTemperatures(request.pattern); !told) return told;
    auto heaters = FirstFailure({CheckTemperatures(session, request.pattern)}, ErrorKind::kSafety);
    if (!heaters) return heaters;
  }
  if (!request.scan) return {};
  const PatternPlan plan = PlanOf(request, request.pattern);
  const double record_s =
      static_cast<double>(plan.lines.size()) *
      (plan.line_length_mm / request.settings.scan_speed_mm_s + 2 * request.settings.settle_s);
  return FirstFailure({CheckDisk(request.folder, record_s, request.settings.frames_per_s)},
                      ErrorKind::kInput);
}

Result<void> Home(const Session& session) {
  if (auto free = CheckStillFree(session); !free) return free;
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return tl::unexpected(state.error());
  for (const char axis : std::string("xyz")) {
    if (state->homed_axes.find(axis) == std::string::npos) {
      session.Tell({.text = "homing", .remaining_s = {}, .phase = "homing"});
      return session.printer.Run("G28", session.Within(kHome_s));
    }
  }
  return {};
}

// Klipper answers calls for a moment longer than it does what they ask: where it stops or restarts
// right after a failure, that is the reason.
Result<void> WithReason(const Session& session, Result<void> done) {
  constexpr double kSettle_s = 0.7;
  if (done || done.error().kind != ErrorKind::kMachine) return done;
  const auto left = session.printer.WaitUntil(
      [](const machine::PrinterState& state) {
        return state.readiness != machine::PrinterReadiness::kReady;
      },
      "the printer to settle", {kSettle_s});
  if (!left) return done;
  const std::string reason =
      fmt::format("the printer went to \"{}\" in the middle: ", ToString(left->readiness));
  if (done.error().message.starts_with(reason)) return done;
  return Fail(reason + done.error().message, ErrorKind::kMachine);
}

// A printer without a limit is used all the same, by somebody who knows that it has none.
void SayWhereThereIsNoLimit(const Session& session) {
  if (session.has_limit) return;
  session.Say(
      fmt::format("the printer has no {} (klipper/trammel.cfg): its heaters have no limit "
                  "of their own should this program die, so stay beside it",
                  kKeepAlive));
}

// Named at its cause, whatever failed in consequence.
Result<void> NameRestart(Result<void> done, bool restarted) {
  if (done || !restarted || done.error().kind == ErrorKind::kInterrupted) return done;
  return Fail("the printer was restarted in the middle: " + done.error().message,
              ErrorKind::kMachine);
}

ParkPlace ParkPlaceOf(const PatternConfig& config) {
  const auto park = settings::ParkPositionOf(config);
  return {config.park_lift_mm, park.x_mm, park.y_mm, config.z_speed_mm_s, config.travel_speed_mm_s};
}

// As the printed file left it, whoever wrote that.
double BedTarget_c(const Session& session) {
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return 0;
  const auto bed = state->heaters.find("heater_bed");
  return bed == state->heaters.end() ? 0 : bed->second.target_c;
}

// What was printed loosens where the bed cools. The printer's own idle time-out still ends it.
Result<void> KeepBedWarm(const Session& session, double bed_c) {
  if (bed_c <= 0) return {};
  return SetTarget(session, "heater_bed", bed_c);
}

Result<void> RunSteps(const Session& session, const CalibrationRequest& request,
                      PrinterStateGuard& guard, FrameRecorder* recorder,
                      const std::string& camera) {
  const PatternConfig config = ForThisPrinter(request.pattern, guard.before());
  const PatternPlan plan = PlanOf(request, config);
  if (request.print) {
    if (auto printed = PrintPattern(session, request, config, plan); !printed) return printed;
  }
  if (recorder == nullptr) return {};
  return SweepLines(session, request, config, plan, *recorder, camera, guard);
}

}  // namespace

Result<std::unique_ptr<machine::FrameSource>> OpenCamera(const Session& session,
                                                         const ScanSettings& settings) {
  machine::CameraOptions options;
  options.width_px = settings.frame_width_px;
  options.height_px = settings.frame_height_px;
  options.frames_per_s = settings.frames_per_s;
  options.jpeg_quality = kJpegQuality;
  if (!settings.camera.empty()) return machine::OpenCamera(settings.camera, options, session.stop);
  const auto webcams = session.printer.Webcams(session.Within(kAsk_s));
  if (!webcams) return tl::unexpected(webcams.error());
  for (const machine::Webcam& webcam : *webcams) {
    if (webcam.enabled && (settings.webcam.empty() || settings.webcam == webcam.name)) {
      return machine::OpenCamera(webcam.stream_url, options, session.stop);
    }
  }
  return Fail(
      fmt::format("the printer's server lists no camera{}: set [camera] url to the stream's "
                  "address",
                  settings.webcam.empty() ? "" : " named " + settings.webcam),
      ErrorKind::kMachine);
}

namespace {

struct Eye {
  std::unique_ptr<machine::FrameSource> camera;
  std::unique_ptr<FrameRecorder> recorder;
};

// A camera that sends pictures, or nothing where none is wanted.
Result<Eye> OpenEye(const Session& session, const CalibrationRequest& request) {
  Eye eye;
  if (!request.scan) return eye;
  session.Tell({.text = "looking at the camera", .remaining_s = {}, .phase = "checking"});
  auto opened = OpenCamera(session, request.settings);
  if (!opened) return tl::unexpected(opened.error());
  eye.camera = std::move(*opened);
  eye.recorder = std::make_unique<FrameRecorder>(*eye.camera, kStall_s);
  const auto picture = eye.recorder->NextFrame(kStall_s, session.stop);
  if (!picture) return tl::unexpected(picture.error());
  return eye;
}

}  // namespace

CalibrationOutcome Calibrate(const Session& asked, const CalibrationRequest& request) {
  CalibrationOutcome outcome;
  Session session = asked;
  auto state_folder = request.state_folder.empty()
                          ? files::StateFolder()
                          : Result<std::filesystem::path>(request.state_folder);
  if (!state_folder) {
    outcome.done = tl::unexpected(state_folder.error());
    return outcome;
  }
  session.Tell({.text = "checking the printer", .remaining_s = {}, .phase = "checking"});
  if (request.print) {
    outcome.done = EndDeadPrint(session, *state_folder, request.settings.address,
                                ParkPlaceOf(request.pattern));
  }
  if (outcome.done) outcome.done = CheckAll(session, request);
  outcome.done = NameStop(session.stop, std::move(outcome.done));
  if (!outcome.done) return outcome;
  auto guard = PrinterStateGuard::Take(
      session, request.settings,
      {request.run, request.started, request.settings.address, *state_folder, request.print});
  if (!guard) {
    outcome.done = tl::unexpected(NameStop(session.stop, guard.error()));
    return outcome;
  }
  guard->ParkAt(ParkPlaceOf(request.pattern));
  SayWhereThereIsNoLimit(session);
  const auto eye = OpenEye(session, request);
  if (!eye) outcome.done = tl::unexpected(eye.error());
  if (outcome.done) outcome.done = Home(session);
  if (outcome.done) outcome.done = guard->Begin(session);
  outcome.done = NameStop(session.stop, std::move(outcome.done));
  if (outcome.done) {
    const std::string camera =
        eye->camera ? Utf8OrReplaced(eye->camera->Describe(), kLongestCameraName) : std::string();
    auto done = RunSteps(session, request, *guard, eye->recorder.get(), camera);
    outcome.done = WithReason(session, NameStop(session.stop, std::move(done)));
    if (outcome.done && !request.scan) outcome.bed_c = BedTarget_c(session);
    session.Tell(
        {.text = "bringing back what was set before", .remaining_s = {}, .phase = "restoring"});
  }
  outcome.unrestored = guard->Restore();
  outcome.done = NameRestart(std::move(outcome.done), guard->restarted());
  if (outcome.done && outcome.unrestored.empty() && !request.scan) {
    outcome.done = KeepBedWarm(session, outcome.bed_c);
  }
  return outcome;
}

}  // namespace trammel::procedure

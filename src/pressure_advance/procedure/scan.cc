#include "pressure_advance/procedure/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "base/thread_priority.h"
#include "machine/net/host_clock.h"
#include "pressure_advance/laser/stripe_observation.h"
#include "pressure_advance/procedure/plate_layout.h"
#include "pressure_advance/procedure/scan_recording.h"
#include "pressure_advance/setup/stripe_reading.h"

namespace trammel::procedure {
namespace {

constexpr double kCommand_s = 60;
constexpr double kFrame_s = 5;

}  // namespace

Result<machine::CapturedFrame> CheckLaser(const Session& session, FrameRecorder& recorder,
                                          const settings::ScanSettings& settings) {
  const auto off = TRY(recorder.NextFrame(kFrame_s, session.stop));
  TRY(CheckStillFree(session));
  TRY(session.printer.Run(settings.laser_on_gcode, session.Within(kCommand_s)));
  TRY(session.printer.FinishMoves(session.Within(kCommand_s)));
  constexpr double kMin = 0.0005;  // of the pixels: line 2 px wide, a quarter of the picture
  constexpr double kLate_s = 3;    // a stream may show what was some seconds ago
  const double on_s = machine::HostNow();
  double share = 0;
  do {
    auto lit = TRY(recorder.NextFrame(kFrame_s, session.stop));
    const auto redder = TRY(Reddened(off, lit));
    share = std::max(share, redder);
    if (share >= kMin) return std::move(lit);
    TRY(CheckStillReady(session));
  } while (machine::HostNow() < on_s + kLate_s);
  return Fail(
      fmt::format("the camera does not see the laser: after {} only {:.3f} % of the picture "
                  "became redder ({:.2f} % are needed): check the laser, its command, the "
                  "camera's exposure and [camera] focus_height",
                  settings.laser_on_gcode, 100 * share, 100 * kMin),
      ErrorKind::kMachine);
}

Check CheckLaserLine(const machine::CapturedFrame& lit, const settings::ScanSettings& settings) {
  constexpr const char* kName = "laser line";
  const auto advise = [&](std::string what) { return Check{kName, false, std::move(what), true}; };
  const auto picture = machine::DecodeFrame(lit);
  if (!picture) return advise(picture.error().message);
  vision::LaserLineWorkspace workspace;
  const bool down = pressure_advance::StripeRunsDown(picture->view());
  const auto stripe = pressure_advance::ReadStripe(picture->view(), down, workspace);
  if (!stripe.fault.empty()) return advise(stripe.fault);
  constexpr double kFullWidth = 2.35482;  // Gaussian's full width at half maximum, in sigmas
  const double width_px = kFullWidth * stripe.width_px;
  const pressure_advance::StripeObservation observation{width_px, stripe.peak, stripe.saturated_px};
  const auto notices = pressure_advance::ObservationNotices({&observation, 1}, settings.px_per_mm);
  if (!notices.empty()) return advise(notices.front());
  return Pass(kName, fmt::format("{:.1f} px{} wide at half its height, {:.0f} grey levels over the "
                                 "plate",
                                 width_px,
                                 settings.px_per_mm
                                     ? fmt::format(" ({:.2f} mm)", width_px / *settings.px_per_mm)
                                     : "",
                                 stripe.peak));
}

namespace {

using settings::ScanSettings;

constexpr double kMove_s = 60;
constexpr double kClock_s = 0.002;  // at 7 mm/s 0.013 mm
// Number of frames with the head at rest before and after a sweep: those required for its timing,
// and some for frames that a camera drops.
constexpr std::size_t kStandingFrames = 8;

AxisDirection DirectionOf(const Sweep& sweep) {
  if (std::abs(sweep.along_x) >= std::abs(sweep.along_y)) {
    return sweep.along_x > 0 ? AxisDirection::kPlusX : AxisDirection::kMinusX;
  }
  return sweep.along_y > 0 ? AxisDirection::kPlusY : AxisDirection::kMinusY;
}

Result<void> Go(const Session& session, const std::string& gcode) {
  TRY(CheckStillFree(session));
  TRY(RunNoted(session, gcode, kMove_s));
  return session.printer.FinishMoves(session.Within(kMove_s));
}

Result<void> Stand(const Session& session, double time_s) {
  if (Pause(time_s, session.stop)) return CheckStillHomed(session);
  return Fail("stopped during the scan", ErrorKind::kInterrupted);
}

// Data of a sweep besides its own position.
struct Sweeping {
  const Session& session;
  FrameRecorder& recorder;
  const ScanRequest& request;
  std::array<double, 4> gcode_origin_mm{};  // origin of G-code coordinates in the toolhead's
};

// Returns the motion between two moments of the host's clock, along the run. Reports received
// before the frames ended are nearly always complete; the rest arrives within a second.
Result<void> AskMotion(const Sweeping& sweeping, std::span<const Sweep> run, double from_s,
                       double to_s, RecordedSweep& recorded) {
  machine::Printer& printer = sweeping.session.printer;
  const auto clock = TRY(printer.Clock(kClock_s, sweeping.session.Within(kFrame_s)));
  recorded.clock_sigma_s = clock.PrintTimeBound(to_s) / std::sqrt(3.0);
  recorded.motion =
      AlongLine(printer.ReportedMoves(clock.PrintTimeOf(from_s), clock.PrintTimeOf(to_s)), run,
                clock, sweeping.gcode_origin_mm);
  if (IsWhole(recorded.motion, run)) return {};
  const auto moves = TRY(printer.Moves(clock.PrintTimeOf(from_s), clock.PrintTimeOf(to_s),
                                       sweeping.session.Within(kFrame_s)));
  recorded.motion = AlongLine(moves, run, clock, sweeping.gcode_origin_mm);
  if (!recorded.motion.empty()) return {};
  TRY(CheckStillHomed(sweeping.session));
  return Fail("the printer told of no motion during a sweep: does its firmware have motion_report?",
              ErrorKind::kMeasurement);
}

// Sweeps the lines of a run with the camera recording.
// @returns when the head was at rest for it, so that the travel's end is not mistaken for the
// sweep's beginning.
Result<double> RecordSweep(const Sweeping& sweeping, std::span<const Sweep> run, double speed_mm_s,
                           RecordedSweep& recorded) {
  const Session& session = sweeping.session;
  const ScanSettings& settings = sweeping.request.settings;
  TRY(sweeping.recorder.Begin(sweeping.request.folder / recorded.video, settings.frames_per_s));
  const auto stand = [&]() -> Result<void> {  // now it does
    const double now_s = machine::HostNow();
    TRY(Stand(session, settings.settle_s));
    sweeping.recorder.WaitForFrames(kStandingFrames, now_s, kFrame_s, session.stop);
    return CheckStillHomed(session);
  };
  Result<void> swept = stand();
  const double stood_s = machine::HostNow();
  // Sends single moves: queued ones would continue after a stop, with the laser lit. Klipper may
  // begin a print between two of them.
  for (const std::string& move : SweepGcode(run, speed_mm_s)) {
    if (swept) swept = CheckStillFree(session);
    if (swept) swept = session.printer.Run(move, session.Within(kMove_s));
  }
  if (swept) swept = session.printer.FinishMoves(session.Within(kMove_s));
  if (swept) swept = stand();
  auto frames = sweeping.recorder.End();
  if (!swept) return tl::unexpected(swept.error());
  if (!frames) return tl::unexpected(frames.error());
  recorded.frames = std::move(*frames);
  return stood_s;
}

Result<RecordedSweep> SweepLines(const Sweeping& sweeping, std::span<const Sweep> run,
                                 std::string video, double speed_mm_s) {
  const Session& session = sweeping.session;
  RecordedSweep recorded;
  const std::vector<SweptStretch> stretches = StretchesOf(run);
  for (std::size_t i = 0; i < run.size(); ++i) {
    recorded.lines.push_back(
        {run[i].pressure_advance_s, DirectionOf(run[i]), stretches.at(i), run[i].pattern});
  }
  recorded.video = std::move(video);
  auto ready = Go(session, TravelGcode(run.front(), sweeping.request.travel_speed_mm_s));
  if (ready) ready = KeepAlive(session);
  // Repeated for each run: the printer's own limit switches a forgotten laser off.
  if (ready) ready = Go(session, sweeping.request.settings.laser_on_gcode);
  if (!ready) return tl::unexpected(ready.error());
  const auto from_s = TRY(RecordSweep(sweeping, run, speed_mm_s, recorded));
  TRY(AskMotion(sweeping, run, from_s, machine::HostNow(), recorded));
  return recorded;
}

// Switches lights off, moves the camera to its focus height above the first line, checks the laser.
Result<void> Prepare(const Sweeping& sweeping, const SweepPlan& sweeps) {
  const Session& session = sweeping.session;
  const ScanRequest& request = sweeping.request;
  TRY(CheckStillFree(session));
  TRY(session.printer.RecordMoves(session.Within(kMove_s)));
  if (!request.settings.lights_off_gcode.empty()) {
    TRY(Go(session, request.settings.lights_off_gcode));
  }
  session.Report({.text = "moving the camera to its focus height",
                  .remaining_s = {},
                  .phase = "scanning",
                  .done = 0});
  auto there = Go(session, FocusGcode(sweeps.z_mm, request.z_speed_mm_s));
  if (there) there = Go(session, TravelGcode(sweeps.sweeps.front(), request.travel_speed_mm_s));
  if (!there || request.laser_seen) return there;
  TRY(CheckLaser(session, sweeping.recorder, request.settings));
  return {};
}

// Maximum number of sweeps of a line that could not be placed.
constexpr int kMaxSweepsOfALine = 3;
constexpr std::size_t kHopeless = 3;  // lines, without one of them in its place
// A busy computer loses frames and delivers them late: at half the speed both affect half the
// distance. Below this limit the picture changes too little from frame to frame (the paper scans at
// 6.7 mm/s).
constexpr double kSlowest_mm_s = 5;

// "line 3", "lines 1 to 5", counted from 1.
std::string NameOf(const SweepRun& run) {
  if (run.count == 1) return fmt::format("line {}", run.first + 1);
  return fmt::format("lines {} to {}", run.first + 1, run.first + run.count);
}

// Speed of the next sweeps, and the number of repeats left.
struct Pace {
  double speed_mm_s = 0;
  std::size_t repeats_left = 0;
};

// Repeats a run until its frames can be placed, a few times at most and each time more slowly.
// Finally omits frames that cannot be placed.
Result<void> SweepRunAndAgain(const Sweeping& sweeping, const SweepPlan& sweeps,
                              const SweepRun& run, int attempt, Pace& pace,
                              ScanRecording& recording) {
  for (SweepRun rest = run; rest.count > 0;) {
    const SweepRun part = sweeps.FirstPartOf(rest, pace.speed_mm_s);
    rest = {rest.first + part.count, rest.count - part.count};
    std::string video = attempt == 1 ? fmt::format("line{}.avi", part.first)
                                     : fmt::format("line{}-{}.avi", part.first, attempt);
    auto swept = TRY(SweepLines(sweeping, sweeps.Of(part), std::move(video), pace.speed_mm_s));
    TRY(recording.Add(std::move(swept)));
    if (!recording.trouble() || attempt == kMaxSweepsOfALine || pace.repeats_left == 0) continue;
    --pace.repeats_left;
    const double slower_mm_s = std::max(pace.speed_mm_s / 2, kSlowest_mm_s);
    pace.speed_mm_s = std::min(pace.speed_mm_s, slower_mm_s);
    sweeping.session.Report(fmt::format("scanning {} again, at {:.3g} mm/s: {}", NameOf(part),
                                        pace.speed_mm_s, *recording.trouble()));
    TRY(recording.SetLastAside());
    TRY(SweepRunAndAgain(sweeping, sweeps, part, attempt + 1, pace, recording));
  }
  return {};
}

// Adds to an error which data are safe.
Result<void> WithWhatIsSafe(Result<void> failed, const ScanRecording& recording,
                            const std::filesystem::path& folder) {
  constexpr std::size_t kFewest = 2;  // lines that an analysis can do with
  if (failed || recording.safe() < kFewest) return failed;
  return Fail(fmt::format("{}; {} lines are safe: trammel pa analyze {}", failed.error().message,
                          recording.safe(), folder.string()),
              failed.error().kind);
}

// Computes the time from the first sweep's start, where the head is; excludes the commands' own.
double SweepTime_s(const SweepPlan& sweeps, const ScanRequest& request) {
  settings::PrinterSettings printer;
  printer.travel_speed_mm_s = request.travel_speed_mm_s;
  const Sweep& first = sweeps.sweeps.front();
  return TimeOf(sweeps, printer, request.plan.acceleration_mm_s2,
                {first.start_x_mm, first.start_y_mm, sweeps.z_mm})
      .total_s();
}

Result<void> ScanAll(const Sweeping& sweeping, const SweepPlan& sweeps, ScanRecording& recording) {
  const std::size_t lines = sweeps.sweeps.size();
  Pace pace{sweeps.speed_mm_s, lines};
  const double begin_s = machine::HostNow();
  double each_s = SweepTime_s(sweeps, sweeping.request) / static_cast<double>(lines);
  for (const SweepRun& run : sweeps.runs) {
    const std::size_t i = run.first;
    // Times of travels and waits are known after the first run.
    if (i > 0) each_s = (machine::HostNow() - begin_s) / static_cast<double>(i);
    sweeping.session.Report({.text = fmt::format("scanning {} of {}", NameOf(run), lines),
                             .remaining_s = each_s * static_cast<double>(lines - i),
                             .phase = "scanning",
                             .done = static_cast<double>(i) / static_cast<double>(lines)});
    auto scanned = SweepRunAndAgain(sweeping, sweeps, run, 1, pace, recording);
    if (!scanned) return WithWhatIsSafe(scanned, recording, sweeping.request.folder);
    if (i + run.count >= kHopeless && recording.placed() == 0 && recording.trouble()) break;
  }
  for (const std::string& line : recording.LeftOut()) sweeping.session.Report(line);
  return recording.Finish();
}

}  // namespace

Result<void> ScanLines(const Session& session, FrameRecorder& recorder, const SweepPlan& sweeps,
                       const ScanRequest& request) {
  const auto state = TRY(session.printer.State(session.Within(kFrame_s)));
  const Sweeping sweeping{session, recorder, request, state.gcode.homing_origin_mm};
  TRY(Prepare(sweeping, sweeps));
  if (const ThreadPriority priority = recorder.priority(); !priority.raised) {
    session.Report("frames are fetched at the usual priority: " + priority.text);
  }
  ScanRecording recording(request, sweeps.sweeps.size());
  TRY(recording.Begin());
  return ScanAll(sweeping, sweeps, recording);
}

}  // namespace trammel::procedure

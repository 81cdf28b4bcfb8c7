#include "procedure/scan.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "pressure_advance/sweep_timing.h"
#include "procedure/placed_sweep.h"
#include "store/recording.h"
#include "store/whole_file.h"

namespace trammel::procedure {
namespace {

using machine::CapturedFrame;
using pressure_advance::AxisDirection;
using pressure_advance::MatchSweeps;
using pressure_advance::Scan;
using pressure_advance::ScanLine;
using pressure_advance::ScanSettings;
using pressure_advance::SessionTiming;
using pressure_advance::SweepObservation;

constexpr double kMove_s = 60;
constexpr double kFrame_s = 5;
constexpr double kClock_s = 0.002;  // at 7 mm/s 0.013 mm

// Everything recorded so far.
struct Recorded {
  std::vector<ScanLine> lines;
  std::vector<SweepObservation> sweeps;  // one per line
  double clock_sigma_s = 0;              // worst of all sweeps
  bool our_clock = true;                 // capture times are on this machine's own clock
};

Scan DescribeScan(const ScanRequest& request) {
  const ScanSettings& settings = request.settings;
  Scan scan;
  scan.frames_per_s = settings.frames_per_s;
  scan.scan_speed_mm_s = settings.scan_speed_mm_s;
  scan.px_per_mm = settings.px_per_mm;
  scan.laser_angle_rad = settings.laser_angle_deg * std::acos(-1.0) / 180;
  scan.height_direction = settings.height_direction;
  if (settings.crop_px.size() == 4) {
    const auto whole = [&](std::size_t i) { return static_cast<int>(settings.crop_px[i]); };
    scan.crop = PixelRect{whole(0), whole(1), whole(2), whole(3)};
  }
  scan.line_start_mm = settings.skip_mm;
  scan.motion.segments = request.plan.segments;
  scan.motion.length_mm = request.plan.line_length_mm;
  scan.motion.acceleration_mm_s2 = request.plan.acceleration_mm_s2;
  return scan;
}

AxisDirection DirectionOf(const Sweep& sweep) {
  if (std::abs(sweep.along_x) >= std::abs(sweep.along_y)) {
    return sweep.along_x > 0 ? AxisDirection::kPlusX : AxisDirection::kMinusX;
  }
  return sweep.along_y > 0 ? AxisDirection::kPlusY : AxisDirection::kMinusY;
}

SessionTiming Place(const Recorded& recorded, const ScanSettings& settings) {
  pressure_advance::SweepTimingOptions options;
  options.nominal_frames_per_s = settings.frames_per_s;
  options.arrival_offset = pressure_advance::ClockOffset{0, recorded.clock_sigma_s};
  if (recorded.our_clock) options.captured_offset = options.arrival_offset;
  return MatchSweeps(recorded.sweeps, options);
}

// scan.json with the lines whose frames could be placed; the others are named with the reason.
Result<SessionTiming> WriteScan(const ScanRequest& request, const Recorded& recorded) {
  SessionTiming timing = Place(recorded, request.settings);
  Scan scan = DescribeScan(request);
  nlohmann::json extra = {{"x_started", request.started}, {"x_camera", request.camera}};
  if (timing.latency_s.good()) {
    extra["x_latency_s"] = timing.latency_s.quantity().value;
    extra["x_latency_sigma_s"] = timing.latency_s.quantity().standard_uncertainty;
  } else {
    extra["x_not_placed"] = timing.latency_s.reason();
  }
  for (std::size_t i = 0; i < timing.sweeps.size(); ++i) {
    ScanLine line = recorded.lines[i];
    line.frame_positions_mm = ScoredPositions(timing.sweeps[i]);
    scan.lines.push_back(std::move(line));
  }
  if (scan.lines.empty()) return timing;
  const auto written =
      store::WriteWholeFile(request.folder / "scan.json", store::FormatScan(scan, extra));
  if (!written) return tl::unexpected(written.error());
  return timing;
}

// The laser must be seen before it is believed: an unplugged one would be measured as noise.
Result<void> CheckLaser(const Session& session, FrameRecorder& recorder,
                        const ScanSettings& settings) {
  const auto off = recorder.NextFrame(kFrame_s, session.stop);
  if (!off) return tl::unexpected(off.error());
  if (auto on = session.printer.Run(settings.laser_on_gcode, session.Within(kMove_s)); !on) {
    return on;
  }
  if (auto done = session.printer.FinishMoves(session.Within(kMove_s)); !done) return done;
  constexpr double kLeast = 0.0005;  // of the pixels: a line of 2 px over a quarter of the picture
  double share = 0;
  for (int attempt = 0; attempt < 10; ++attempt) {  // delivery may lag by some frames
    const auto lit = recorder.NextFrame(kFrame_s, session.stop);
    if (!lit) return tl::unexpected(lit.error());
    const auto redder = Reddened(*off, *lit);
    if (!redder) return tl::unexpected(redder.error());
    share = std::max(share, *redder);
    if (share >= kLeast) return {};
  }
  return Fail(
      fmt::format("the camera does not see the laser: after {} only {:.3f} % of the picture "
                  "became redder ({:.2f} % are needed): check the laser, its command, the "
                  "camera's exposure and [camera] focus_height",
                  settings.laser_on_gcode, 100 * share, 100 * kLeast),
      ErrorKind::kMachine);
}

Result<void> Go(const Session& session, const std::string& gcode) {
  if (auto done = session.printer.Run(gcode, session.Within(kMove_s)); !done) return done;
  return session.printer.FinishMoves(session.Within(kMove_s));
}

Result<void> Stand(const Session& session, double time_s) {
  if (Pause(time_s, session.stop)) return {};
  return Fail("stopped during the scan", ErrorKind::kInterrupted);
}

// The motion between two moments of the host's clock, along the line.
Result<std::vector<pressure_advance::LineMove>> MotionOf(const Session& session, const Sweep& sweep,
                                                         double from_s, double to_s,
                                                         Recorded& recorded) {
  const auto clock = session.printer.Clock(kClock_s, session.Within(kFrame_s));
  if (!clock) return tl::unexpected(clock.error());
  recorded.clock_sigma_s =
      std::max(recorded.clock_sigma_s, clock->PrintTimeBound(to_s) / std::sqrt(3.0));
  const auto moves = session.printer.Moves(clock->PrintTimeOf(from_s), clock->PrintTimeOf(to_s),
                                           session.Within(kFrame_s));
  if (!moves) return tl::unexpected(moves.error());
  auto along = AlongLine(*moves, sweep, *clock);
  if (along.empty()) {
    return Fail(
        "the printer told of no motion during a sweep: does its firmware have motion_report?",
        ErrorKind::kMeasurement);
  }
  return along;
}

Result<void> SweepLine(const Session& session, FrameRecorder& recorder, const Sweep& sweep,
                       const ScanRequest& request, double speed_mm_s, Recorded& recorded) {
  const ScanSettings& settings = request.settings;
  ScanLine line;
  line.pressure_advance_s = sweep.pressure_advance_s;
  line.print_direction = DirectionOf(sweep);
  line.video = fmt::format("line{}.avi", recorded.lines.size());
  if (auto there = Go(session, TravelGcode(sweep, request.travel_speed_mm_s)); !there) return there;
  // Again for each line: the printer's own limit switches a forgotten laser off.
  if (auto on = Go(session, settings.laser_on_gcode); !on) return on;
  const double from_s = machine::MonotonicNow();
  if (auto begun = recorder.Begin(request.folder / line.video, settings.frames_per_s); !begun) {
    return begun;
  }
  Result<void> swept = Stand(session, settings.settle_s);
  if (swept) swept = Go(session, SweepGcode(sweep, speed_mm_s));
  if (swept) swept = Stand(session, settings.settle_s);
  const double to_s = machine::MonotonicNow();
  auto frames = recorder.End();
  if (!swept) return swept;
  if (!frames) return tl::unexpected(frames.error());
  auto motion = MotionOf(session, sweep, from_s, to_s, recorded);
  if (!motion) return tl::unexpected(motion.error());
  auto seen = Observe(*frames, std::move(*motion));
  if (!seen) return tl::unexpected(seen.error());
  for (const CapturedFrame& frame : *frames) {
    recorded.our_clock = recorded.our_clock && frame.captured &&
                         frame.captured->clock == machine::CameraClock::kOurs;
  }
  recorded.lines.push_back(std::move(line));
  recorded.sweeps.push_back(std::move(*seen));
  return {};
}

}  // namespace

Result<void> ScanLines(const Session& session, FrameRecorder& recorder, const SweepPlan& sweeps,
                       const ScanRequest& request) {
  const ScanSettings& settings = request.settings;
  if (auto done = session.printer.RecordMoves(session.Within(kMove_s)); !done) return done;
  if (!settings.lights_off_gcode.empty()) {
    if (auto dark = Go(session, settings.lights_off_gcode); !dark) return dark;
  }
  session.Say("moving the camera to its focus height");
  if (auto up = Go(session,
                   fmt::format("G90\nG1 Z{:.3f} F{:.0f}", sweeps.z_mm, 60 * request.z_speed_mm_s));
      !up) {
    return up;
  }
  if (auto there = Go(session, TravelGcode(sweeps.sweeps.front(), request.travel_speed_mm_s));
      !there) {
    return there;
  }
  if (auto seen = CheckLaser(session, recorder, settings); !seen) return seen;

  Recorded recorded;
  for (const Sweep& sweep : sweeps.sweeps) {
    const std::size_t left = sweeps.sweeps.size() - recorded.lines.size();
    session.Say(
        fmt::format("scanning line {} of {}", recorded.lines.size() + 1, sweeps.sweeps.size()),
        sweeps.sweep_time_s * static_cast<double>(left));
    auto swept = SweepLine(session, recorder, sweep, request, sweeps.speed_mm_s, recorded);
    if (!swept) return swept;
    auto timing = WriteScan(request, recorded);
    if (!timing) return tl::unexpected(timing.error());
    const bool last = recorded.lines.size() == sweeps.sweeps.size();
    if (last && !timing->latency_s.good()) {
      return Fail(
          fmt::format("the frames cannot be tied to the motion: {}; the pictures are kept in "
                      "{}",
                      timing->latency_s.reason(), request.folder.string()),
          ErrorKind::kMeasurement);
    }
  }
  return {};
}

}  // namespace trammel::procedure

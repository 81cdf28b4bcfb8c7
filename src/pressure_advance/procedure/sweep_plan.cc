#include "pressure_advance/procedure/sweep_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/check.h"
#include "gcode/bead.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::procedure {

std::vector<PathLeg> PathOf(std::span<const Sweep> run) {
  TRAMMEL_CHECK(!run.empty(), "a run of {} lines", run.size());
  std::vector<PathLeg> legs;
  double way_mm = run.front().PositionOf(run.front().start_x_mm, run.front().start_y_mm);
  const auto add = [&](double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm,
                       const Sweep* sweep) {
    const double length_mm = std::hypot(to_x_mm - from_x_mm, to_y_mm - from_y_mm);
    if (length_mm == 0) return;
    legs.push_back({from_x_mm, from_y_mm, (to_x_mm - from_x_mm) / length_mm,
                    (to_y_mm - from_y_mm) / length_mm, way_mm, length_mm, sweep});
    way_mm += length_mm;
  };
  const Sweep* before = nullptr;
  for (const Sweep& sweep : run) {
    if (before != nullptr) {
      add(before->end_x_mm, before->end_y_mm, sweep.start_x_mm, sweep.start_y_mm, nullptr);
    }
    add(sweep.start_x_mm, sweep.start_y_mm, sweep.end_x_mm, sweep.end_y_mm, &sweep);
    before = &sweep;
  }
  return legs;
}

std::vector<SweptStretch> StretchesOf(std::span<const Sweep> run) {
  std::vector<SweptStretch> stretches;
  for (const PathLeg& leg : PathOf(run)) {
    if (leg.sweep == nullptr) continue;
    const double along = leg.along_x * leg.sweep->along_x + leg.along_y * leg.sweep->along_y;
    const double direction = along < 0 ? -1 : 1;
    const double position_mm = leg.sweep->PositionOf(leg.x_mm, leg.y_mm);
    stretches.push_back({leg.begin_mm, leg.begin_mm + leg.length_mm,
                         leg.begin_mm - direction * position_mm, direction});
  }
  return stretches;
}

namespace {

using pressure_advance::PatternPlan;
using pressure_advance::PlanLine;
using pressure_advance::PointMm;
using settings::ScanSettings;

Sweep Along(const PlanLine& line, std::size_t index, double length_mm,
            const ScanSettings& settings) {
  Sweep sweep;
  sweep.line = index;
  sweep.pattern = line.pattern;
  sweep.pressure_advance_s = line.pressure_advance_s;
  sweep.along_x = (line.end_x_mm - line.start_x_mm) / length_mm;
  sweep.along_y = (line.end_y_mm - line.start_y_mm) / length_mm;
  // The nozzle is offset from the camera's target.
  const double nozzle_x_mm = line.start_x_mm - settings.camera_offset_x_mm;
  const double nozzle_y_mm = line.start_y_mm - settings.camera_offset_y_mm;
  sweep.origin_mm = nozzle_x_mm * sweep.along_x + nozzle_y_mm * sweep.along_y;
  const double from_mm = settings.skip_mm - settings.run_up_mm;
  const double to_mm = length_mm - settings.skip_mm + settings.run_up_mm;
  sweep.start_x_mm = nozzle_x_mm + from_mm * sweep.along_x;
  sweep.start_y_mm = nozzle_y_mm + from_mm * sweep.along_y;
  sweep.end_x_mm = nozzle_x_mm + to_mm * sweep.along_x;
  sweep.end_y_mm = nozzle_y_mm + to_mm * sweep.along_y;
  return sweep;
}

constexpr double kSeenShare = 0.75;  // of a line's first slow segment that may be skipped

// Returns the line's skippable length: its change of speed must be visible, and a little before.
double FirstSlow_mm(const PatternPlan& plan) {
  if (plan.segments.empty()) return plan.line_length_mm;
  return kSeenShare * plan.segments.front().fraction * plan.line_length_mm;
}

// Checks that enough frames show the stretches that a line is compared with.
Result<void> CheckFrames(const PatternPlan& plan, const ScanSettings& settings) {
  constexpr double kFewest = 3;
  double longest_s = 0;
  for (const PlanLine& line : plan.lines) longest_s = std::max(longest_s, line.pressure_advance_s);
  const auto transitions = pressure_advance::PlanTransitions(
      {plan.segments, plan.line_length_mm, plan.acceleration_mm_s2},
      pressure_advance::PositionUnit::kMillimetre, longest_s);
  if (!transitions) return {};  // said by whoever reads the lines
  double seen_mm = 0;
  for (const Interval& stretch : transitions->reference) {
    seen_mm += std::max(0.0, std::min(stretch.hi, plan.line_length_mm - settings.skip_mm) -
                                 std::max(stretch.lo, settings.skip_mm));
  }
  const double max_mm_s = seen_mm / kFewest * settings.frames_per_s;
  if (settings.scan_speed_mm_s <= max_mm_s) return {};
  return Fail(
      fmt::format("[scan] speed = {:.4g} mm/s is too fast for [camera] fps = {:.4g}: of the "
                  "{:.2f} mm that a line is compared with, a frame every {:.2f} mm shows too "
                  "little; at most {:.3g} mm/s",
                  settings.scan_speed_mm_s, settings.frames_per_s, seen_mm,
                  settings.scan_speed_mm_s / settings.frames_per_s, max_mm_s));
}

constexpr const char* kOutOfReach =
    "move the pattern on the bed ([pressure_advance_pattern] position_x, position_y), or check "
    "[camera] offset_x, offset_y and focus_height";

Result<void> CheckAxis(double value_mm, std::size_t axis, const Reach& reach,
                       const std::string& what) {
  if (value_mm >= reach.minimum_mm[axis] && value_mm <= reach.maximum_mm[axis]) return {};
  return Fail(fmt::format("{} the nozzle would have to go to {} = {:.2f} mm, which lies outside "
                          "{:.2f} ... {:.2f} mm: {}",
                          what, "XYZ"[axis], value_mm, reach.minimum_mm[axis],
                          reach.maximum_mm[axis], kOutOfReach),
              ErrorKind::kSafety);
}

Result<void> CheckReach(double x_mm, double y_mm, const Reach& reach, const std::string& what) {
  TRY(CheckAxis(x_mm, 0, reach, what));
  TRY(CheckAxis(y_mm, 1, reach, what));
  if (reach.Contains(x_mm, y_mm)) return {};
  return Fail(fmt::format("{} the nozzle would have to go to ({:.2f}, {:.2f}) mm, which lies "
                          "outside {}: {}",
                          what, x_mm, y_mm, reach.Describe(), kOutOfReach),
              ErrorKind::kSafety);
}

double Distance_mm(double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm) {
  return std::hypot(to_x_mm - from_x_mm, to_y_mm - from_y_mm);
}

constexpr double kLongestRun_s = 20;  // the printer's own limit switches a laser off after 30 s

// Groups sweeps into runs, and reverses those that begin at their far end.
void PlanRuns(const ScanSettings& settings, SweepPlan& plan) {
  constexpr double kLongestTurn_mm = 10;  // farther lines belong to another pattern
  double way_mm = 0;
  for (std::size_t i = 0; i < plan.sweeps.size(); ++i) {
    Sweep& sweep = plan.sweeps[i];
    const double length_mm =
        Distance_mm(sweep.start_x_mm, sweep.start_y_mm, sweep.end_x_mm, sweep.end_y_mm);
    if (i > 0 && plan.runs.back().count < static_cast<std::size_t>(settings.lines_at_once)) {
      const Sweep& before = plan.sweeps[i - 1];
      const auto turn_mm = [&](double x_mm, double y_mm) {
        return Distance_mm(before.end_x_mm, before.end_y_mm, x_mm, y_mm);
      };
      const bool backwards =
          turn_mm(sweep.end_x_mm, sweep.end_y_mm) < turn_mm(sweep.start_x_mm, sweep.start_y_mm);
      const double turning_mm = backwards ? turn_mm(sweep.end_x_mm, sweep.end_y_mm)
                                          : turn_mm(sweep.start_x_mm, sweep.start_y_mm);
      const double longer_mm = way_mm + turning_mm + length_mm;
      if (turning_mm <= kLongestTurn_mm && longer_mm <= kLongestRun_s * settings.scan_speed_mm_s) {
        if (backwards) {
          std::swap(sweep.start_x_mm, sweep.end_x_mm);
          std::swap(sweep.start_y_mm, sweep.end_y_mm);
        }
        ++plan.runs.back().count;
        way_mm = longer_mm;
        continue;
      }
    }
    plan.runs.push_back({i, 1});
    way_mm = length_mm;
  }
}

}  // namespace

SweepRun SweepPlan::FirstPartOf(const SweepRun& run, double at_mm_s) const {
  SweepRun part{run.first, 1};
  while (part.count < run.count) {
    const SweepRun longer{run.first, part.count + 1};
    const std::vector<PathLeg> legs = PathOf(Of(longer));
    const double way_mm = legs.back().begin_mm + legs.back().length_mm - legs.front().begin_mm;
    if (way_mm > kLongestRun_s * at_mm_s) break;
    part = longer;
  }
  return part;
}

ScanTime TimeOf(const SweepPlan& plan, const settings::PrinterSettings& printer,
                double acceleration_mm_s2, const PointMm& from) {
  const auto move_s = [&](double length_mm, double speed_mm_s) {
    return gcode::MoveTime_s(length_mm, speed_mm_s, acceleration_mm_s2);
  };
  ScanTime time;
  time.travelling_s += move_s(std::abs(plan.z_mm - from.z_mm), printer.z_speed_mm_s);
  double x_mm = from.x_mm, y_mm = from.y_mm;
  for (const SweepRun& run : plan.runs) {
    const auto sweeps = plan.Of(run);
    time.travelling_s +=
        move_s(std::hypot(sweeps.front().start_x_mm - x_mm, sweeps.front().start_y_mm - y_mm),
               printer.travel_speed_mm_s);
    time.standing_s += 2 * plan.settle_s;
    for (const PathLeg& leg : PathOf(sweeps)) {
      (leg.sweep != nullptr ? time.sweeping_s : time.turning_s) +=
          move_s(leg.length_mm, plan.speed_mm_s);
    }
    x_mm = sweeps.back().end_x_mm;
    y_mm = sweeps.back().end_y_mm;
  }
  return time;
}

Result<SweepPlan> PlanSweeps(const PatternPlan& plan, std::optional<int> pattern,
                             const ScanSettings& settings, const Reach& reach) {
  const double swept_mm = plan.line_length_mm - 2 * settings.skip_mm;
  if (!(swept_mm > 0)) {
    return Fail(fmt::format("[scan] skip = {} mm at either end leaves nothing of a line of {} mm",
                            settings.skip_mm, plan.line_length_mm));
  }
  if (const double first_mm = FirstSlow_mm(plan); settings.skip_mm > first_mm) {
    return Fail(
        fmt::format("[scan] skip = {} mm at either end leaves out where a line speeds up, "
                    "{} mm behind its start; at most {:.3g}",
                    settings.skip_mm, first_mm / kSeenShare, first_mm));
  }
  TRY(CheckFrames(plan, settings));
  SweepPlan sweeps;
  sweeps.z_mm = settings.focus_height_mm;
  sweeps.speed_mm_s = settings.scan_speed_mm_s;
  sweeps.settle_s = settings.settle_s;
  TRY(CheckAxis(sweeps.z_mm, 2, reach, "To focus the camera"));
  for (std::size_t i = 0; i < plan.lines.size(); ++i) {
    const PlanLine& line = plan.lines[i];
    if (pattern && line.pattern != *pattern) continue;
    const Sweep sweep = Along(line, i, plan.line_length_mm, settings);
    const std::string what = fmt::format(
        "To scan the line printed at {:.4g} s from ({:.1f}, "
        "{:.1f}),",
        line.pressure_advance_s, line.start_x_mm, line.start_y_mm);
    for (const auto& [x_mm, y_mm] : {std::pair{sweep.start_x_mm, sweep.start_y_mm},
                                     std::pair{sweep.end_x_mm, sweep.end_y_mm}}) {
      TRY(CheckReach(x_mm, y_mm, reach, what));
    }
    sweeps.sweeps.push_back(sweep);
  }
  if (sweeps.sweeps.empty()) {
    return Fail(fmt::format("the plan has no pattern {}, only {} line(s) in others",
                            pattern.value_or(0), plan.lines.size()));
  }
  PlanRuns(settings, sweeps);
  return sweeps;
}

pressure_advance::PatternConfig ParkedForScan(const pressure_advance::PatternConfig& pattern,
                                              const ScanSettings& settings, const Reach& reach) {
  constexpr double kClear_mm = 5;  // clearance of hot end and ooze from the lines
  if (pattern.park_x_mm || pattern.park_y_mm) return pattern;
  const auto layout = LayOut(pattern);
  const auto sweeps = PlanSweeps(MakePlan(layout, pattern, ""), {}, settings, reach);
  if (!sweeps) return pattern;
  const Sweep& first = sweeps->sweeps.front();
  const auto& printed = layout.printed;
  const bool above = first.start_x_mm > printed.min_x_mm - kClear_mm &&
                     first.start_x_mm < printed.max_x_mm + kClear_mm &&
                     first.start_y_mm > printed.min_y_mm - kClear_mm &&
                     first.start_y_mm < printed.max_y_mm + kClear_mm;
  pressure_advance::PatternConfig parked = pattern;
  parked.park_x_mm = first.start_x_mm;
  parked.park_y_mm = first.start_y_mm;
  parked.park_lift_mm = sweeps->z_mm - PrintZ_mm(pattern);
  parked.approach_lift_mm = pattern.approach_lift_mm.value_or(pattern.park_lift_mm);
  return above || FindProblem(parked) ? pattern : parked;
}

std::string FocusGcode(double z_mm, double speed_mm_s) {
  return fmt::format("G90\nM220 S100\nG1 Z{:.3f} F{:.0f}", z_mm, 60 * speed_mm_s);
}

std::string TravelGcode(const Sweep& sweep, double travel_speed_mm_s) {
  return fmt::format("G1 X{:.3f} Y{:.3f} F{:.0f}", sweep.start_x_mm, sweep.start_y_mm,
                     60 * travel_speed_mm_s);
}

std::vector<std::string> SweepGcode(std::span<const Sweep> run, double speed_mm_s) {
  std::vector<std::string> moves;
  for (const Sweep& sweep : run) {
    if (!moves.empty()) moves.push_back(TravelGcode(sweep, speed_mm_s));
    moves.push_back(
        fmt::format("G1 X{:.3f} Y{:.3f} F{:.3f}", sweep.end_x_mm, sweep.end_y_mm, 60 * speed_mm_s));
  }
  return moves;
}

std::string DescribeSweeps(const SweepPlan& plan, const ScanSettings& settings,
                           double travel_speed_mm_s) {
  const auto optional = [](const std::string& gcode) { return gcode.empty() ? "" : gcode + "\n"; };
  std::string text = optional(settings.lights_off_gcode);
  text += FocusGcode(plan.z_mm, 5) + "\n";
  for (const SweepRun& run : plan.runs) {
    const auto sweeps = plan.Of(run);
    const std::string to =
        run.count > 1 ? fmt::format(" ... {:.4g}", sweeps.back().pressure_advance_s) : "";
    text += fmt::format("; line at {:.4g}{} s\n{}\nM400\n{}\n{}\nM400\n",
                        sweeps.front().pressure_advance_s, to,
                        TravelGcode(sweeps.front(), travel_speed_mm_s), settings.laser_on_gcode,
                        fmt::join(SweepGcode(sweeps, plan.speed_mm_s), "\n"));
  }
  return text + settings.laser_off_gcode + "\n" + optional(settings.lights_on_gcode);
}

}  // namespace trammel::procedure

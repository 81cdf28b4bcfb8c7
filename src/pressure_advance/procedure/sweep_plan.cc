#include "pressure_advance/procedure/sweep_plan.h"

#include <fmt/format.h>

#include <cmath>

namespace trammel::procedure {
namespace {

using pressure_advance::PatternPlan;
using pressure_advance::PlanLine;
using settings::ScanSettings;

Sweep Along(const PlanLine& line, std::size_t index, double length_mm,
            const ScanSettings& settings) {
  Sweep sweep;
  sweep.line = index;
  sweep.pressure_advance_s = line.pressure_advance_s;
  sweep.along_x = (line.end_x_mm - line.start_x_mm) / length_mm;
  sweep.along_y = (line.end_y_mm - line.start_y_mm) / length_mm;
  // The nozzle stands beside what the camera looks at.
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

Result<void> CheckReach(double value_mm, std::size_t axis, const Reach& reach,
                        const std::string& what) {
  if (value_mm >= reach.minimum_mm[axis] && value_mm <= reach.maximum_mm[axis]) return {};
  return Fail(
      fmt::format("{} the nozzle would have to go to {} = {:.2f} mm, which lies outside "
                  "{:.2f} ... {:.2f} mm: move the pattern on the bed ([pressure_advance_"
                  "pattern] position_x, position_y), or check [camera] offset_x, offset_y "
                  "and focus_height",
                  what, "XYZ"[axis], value_mm, reach.minimum_mm[axis], reach.maximum_mm[axis]),
      ErrorKind::kSafety);
}

}  // namespace

double SweepPlan::time_s() const { return sweep_time_s * static_cast<double>(sweeps.size()); }

Result<SweepPlan> PlanSweeps(const PatternPlan& plan, std::optional<int> pattern,
                             const ScanSettings& settings, const Reach& reach) {
  const double swept_mm = plan.line_length_mm - 2 * settings.skip_mm;
  if (!(swept_mm > 0)) {
    return Fail(fmt::format("[scan] skip = {} mm at either end leaves nothing of a line of {} mm",
                            settings.skip_mm, plan.line_length_mm));
  }
  SweepPlan sweeps;
  sweeps.z_mm = settings.focus_height_mm;
  sweeps.speed_mm_s = settings.scan_speed_mm_s;
  sweeps.sweep_time_s =
      (swept_mm + 2 * settings.run_up_mm) / settings.scan_speed_mm_s + 2 * settings.settle_s;
  if (auto done = CheckReach(sweeps.z_mm, 2, reach, "To focus the camera"); !done) {
    return tl::unexpected(done.error());
  }
  for (std::size_t i = 0; i < plan.lines.size(); ++i) {
    const PlanLine& line = plan.lines[i];
    if (pattern && line.pattern != *pattern) continue;
    const Sweep sweep = Along(line, i, plan.line_length_mm, settings);
    const std::string what = fmt::format(
        "To scan the line printed at {:.4g} s from ({:.1f}, "
        "{:.1f}),",
        line.pressure_advance_s, line.start_x_mm, line.start_y_mm);
    for (const auto& [value_mm, axis] :
         {std::pair{sweep.start_x_mm, 0}, std::pair{sweep.end_x_mm, 0},
          std::pair{sweep.start_y_mm, 1}, std::pair{sweep.end_y_mm, 1}}) {
      if (auto done = CheckReach(value_mm, static_cast<std::size_t>(axis), reach, what); !done) {
        return tl::unexpected(done.error());
      }
    }
    sweeps.sweeps.push_back(sweep);
  }
  if (sweeps.sweeps.empty()) {
    return Fail(fmt::format("the plan has no pattern {}, only {} line(s) in others",
                            pattern.value_or(0), plan.lines.size()));
  }
  return sweeps;
}

std::string TravelGcode(const Sweep& sweep, double travel_speed_mm_s) {
  return fmt::format("G1 X{:.3f} Y{:.3f} F{:.0f}", sweep.start_x_mm, sweep.start_y_mm,
                     60 * travel_speed_mm_s);
}

std::string SweepGcode(const Sweep& sweep, double speed_mm_s) {
  return fmt::format("G1 X{:.3f} Y{:.3f} F{:.3f}", sweep.end_x_mm, sweep.end_y_mm, 60 * speed_mm_s);
}

std::string DescribeSweeps(const SweepPlan& plan, const ScanSettings& settings,
                           double travel_speed_mm_s) {
  const auto optional = [](const std::string& gcode) { return gcode.empty() ? "" : gcode + "\n"; };
  std::string text = optional(settings.lights_off_gcode);
  text += fmt::format("G90\nG1 Z{:.3f} F{:.0f}\n", plan.z_mm, 60 * 5.0);
  for (const Sweep& sweep : plan.sweeps) {
    text += fmt::format("; line at {:.4g} s\n{}\nM400\n{}\n{}\nM400\n", sweep.pressure_advance_s,
                        TravelGcode(sweep, travel_speed_mm_s), settings.laser_on_gcode,
                        SweepGcode(sweep, plan.speed_mm_s));
  }
  return text + settings.laser_off_gcode + "\n" + optional(settings.lights_on_gcode);
}

}  // namespace trammel::procedure

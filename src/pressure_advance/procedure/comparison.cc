#include "pressure_advance/procedure/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/pattern/pattern_plan.h"

namespace trammel::procedure {
namespace {

using pressure_advance::BoundsMm;
using pressure_advance::PatternConfig;
using settings::ScanSettings;

constexpr const char* kHeatOnly = "M190 S{bed_temperature_c}\nM109 S{nozzle_temperature_c}\n";
// The nozzle's flank must not touch what lies there.
constexpr double kLeastGap_mm = 5;

bool Fits(const PatternConfig& config, const ScanSettings& settings, const Reach& reach) {
  if (FindProblem(config)) return false;
  const auto layout = LayOut(config);
  return reach.Contains(layout.printed) &&
         PlanSweeps(MakePlan(layout, config, ""), {}, settings, reach).has_value();
}

}  // namespace

Result<PatternConfig> ComparisonPattern(const PatternConfig& settings, double pressure_advance_s) {
  // What G-code writes with its decimals must differ from the control's 0.
  constexpr double kLeast_s = 0.0001;
  if (!(pressure_advance_s >= kLeast_s && pressure_advance_s <= 10)) {
    return Fail(
        fmt::format("a pressure advance of {} s cannot be compared with none: it must lie within "
                    "{} ... 10 s",
                    pressure_advance_s, kLeast_s));
  }
  PatternConfig config = settings;
  config.pressure_advances_s.clear();
  config.line_count = kComparisonLines;
  config.control_pressure_advance_s = 0;
  config.compare_pressure_advance_s = pressure_advance_s;
  config.columns = 1;
  config.rows = 2;
  config.patterns.reset();
  config.conditions.clear();
  return config;
}

Result<PatternConfig> ComparisonBeside(const PatternConfig& printed, double pressure_advance_s,
                                       const ScanSettings& settings, const Reach& reach) {
  auto pattern = ComparisonPattern(printed, pressure_advance_s);
  if (!pattern) return pattern;
  PatternConfig config = *pattern;
  config.start_gcode = kHeatOnly;
  const BoundsMm there = OuterBounds(printed);
  const double gap_mm = std::max(kLeastGap_mm, config.pattern_gap_mm);
  for (const auto& [columns, rows] : {std::pair{1, 2}, std::pair{2, 1}}) {
    config.columns = columns;
    config.rows = rows;
    const BoundsMm size = OuterBounds(config);
    const double width_mm = size.max_x_mm - size.min_x_mm;
    const double depth_mm = size.max_y_mm - size.min_y_mm;
    for (const auto& [x_mm, y_mm] :
         {std::pair{there.max_x_mm + gap_mm, there.min_y_mm},
          std::pair{there.min_x_mm - gap_mm - width_mm, there.min_y_mm},
          std::pair{there.min_x_mm, there.max_y_mm + gap_mm},
          std::pair{there.min_x_mm, there.min_y_mm - gap_mm - depth_mm}}) {
      config.position_x_mm = x_mm;
      config.position_y_mm = y_mm;
      if (Fits(config, settings, reach)) return config;
    }
  }
  return Fail(
      "there is no room beside the pattern for the two of the comparison, within the reach of "
      "nozzle and camera: move the pattern on the bed ([pressure_advance_pattern] position_x, "
      "position_y), or calibrate without --validate, clean the plate and run trammel pa validate "
      "with the recording's folder",
      ErrorKind::kSafety);
}

}  // namespace trammel::procedure

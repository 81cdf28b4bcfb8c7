#include "pressure_advance/procedure/comparison.h"

#include <fmt/format.h>

#include <utility>

#include "pressure_advance/procedure/plate_layout.h"

namespace trammel::procedure {

using pressure_advance::PatternConfig;
using settings::ScanSettings;

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
  for (const auto& [columns, rows] : {std::pair{1, 2}, std::pair{2, 1}}) {
    PatternConfig config = *pattern;
    config.columns = columns;
    config.rows = rows;
    if (auto placed = PlacedBeside(std::move(config), printed, settings, reach)) {
      return std::move(*placed);
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

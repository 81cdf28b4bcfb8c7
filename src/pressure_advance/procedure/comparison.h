// The pattern that shows what a pressure advance is worth: lines without, and lines with it.
#pragma once

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Lines of either kind: enough for a scatter, and no more to print than the calibration.
inline constexpr int kComparisonLines = 5;

/// Two frames of lines like the calibration's, one behind the other: the first without pressure
/// advance, the second with the value. Lies where the settings put a pattern, on a clean plate.
/// Errors: kInput where the value is not above 0 … 10 s.
[[nodiscard]] Result<pressure_advance::PatternConfig> ComparisonPattern(
    const pressure_advance::PatternConfig& settings, double pressure_advance_s);

/// The same beside a pattern that lies on the plate already: to its right, left, behind or in front
/// of it, one behind the other or side by side, wherever nozzle and camera can reach all of it. Its
/// file only heats: a start G-code that homes would probe the plate where the first pattern lies.
/// @param printed  settings of the pattern on the plate. REQUIRES valid ones.
/// Errors: kSafety where there is no room; says what to do instead.
[[nodiscard]] Result<pressure_advance::PatternConfig> ComparisonBeside(
    const pressure_advance::PatternConfig& printed, double pressure_advance_s,
    const settings::ScanSettings& settings, const Reach& reach);

}  // namespace trammel::procedure

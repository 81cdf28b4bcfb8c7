// Several patterns beside one another, wherever nozzle and camera reach all of them.
#pragma once

#include <string>

#include "base/measured.h"
#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Patterns that one plate may be asked for.
inline constexpr int kFewestPatterns = 2;
inline constexpr int kMostPatterns = 9;

/// Lays `count` patterns of these settings beside one another in the grid with the shortest
/// diagonal that fits: as near the middle of the bed as bed, nozzle and camera let them, or with
/// its front left corner where position_x and position_y put it.
/// @param one  valid settings of one pattern; its columns and rows are 1
/// @param option  of the command line that asks for so many
/// Errors: kInput where the settings lay a grid themselves; those of PlanSweeps, also where one
/// pattern alone does not fit; kSafety where `count` do not, with the number that does.
[[nodiscard]] Result<pressure_advance::PatternConfig> PatternsBeside(
    const pressure_advance::PatternConfig& one, int count, const settings::ScanSettings& settings,
    const Reach& reach, const std::string& option = "--repeat");

/// The pattern that is printed where the first could not tell because of its range: as many lines
/// over another one, beside it: to its right, left, behind or in front, wherever nozzle and camera
/// reach all of it. Its file only heats.
/// @param range_s  0 <= lo < hi
/// Errors: kSafety where there is no room; says what to do instead.
[[nodiscard]] Result<pressure_advance::PatternConfig> RefinedBeside(
    const pressure_advance::PatternConfig& printed, const Interval& range_s,
    const settings::ScanSettings& settings, const Reach& reach);

}  // namespace trammel::procedure

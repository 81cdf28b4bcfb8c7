// Several patterns beside one another, wherever nozzle and camera reach all of them.
#pragma once

#include <string>

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

}  // namespace trammel::procedure

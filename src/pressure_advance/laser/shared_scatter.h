// What the lines of one scan tell of each other's noise.
#pragma once

#include <span>

#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// Draws each area's sigma half way (geometric mean), by a factor of 1.5 at most, to the median
/// over the scan's lines of their median sigmas.
///
/// A frame's foretold noise and a line's scatter, told from some thirty differences, are themselves
/// uncertain by about as much as they differ within a scan of one filament on one plate: as weights
/// they cost more than they tell. What lies far off (a string across a line) stays so.
/// @param lines  of one scan, all measured in the same unit; samples that are not seen stay so.
void ShareScatter(std::span<LineProfile> lines);

}  // namespace trammel::pressure_advance

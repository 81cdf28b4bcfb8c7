// Derives the moves of a tap from its recorded heights.
#pragma once

#include <span>
#include <vector>

#include "tap/samples/tap.h"

namespace trammel::files {

/// Derives approach, halt, start, cruise and end of the pull-back from z at the samples' times.
/// Assumes that z falls at one speed, rests, and rises at one speed; that the head accelerates
/// within one sample interval, which nothing in z contradicts; and that z is as exact as a firmware
/// computes it.
/// @returns five moves, or none if z does not look like that: not finite, unsorted, no descent of
/// at least four samples, no rise of at least eight, or residuals above 3 um.
[[nodiscard]] std::vector<tap::Move> MovesFromZ(std::span<const double> time_s,
                                                std::span<const double> z_mm);

}  // namespace trammel::files

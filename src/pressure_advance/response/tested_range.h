// An answer against the range of pressure advances that was printed.
#pragma once

#include <span>
#include <string>

#include "base/measured.h"
#include "pressure_advance/profile/analysis.h"

namespace trammel::pressure_advance {

/// The least and the greatest of the values. REQUIRES at least one.
[[nodiscard]] Interval RangeOf(std::span<const double> pressure_advance_s);

/// The range to print next where the answer lies about `about_s`: as wide as the tested one, about
/// that value, and wider at both ends by what was extrapolated to it; nothing below 0.
[[nodiscard]] Interval PrintNext(double about_s, const Interval& tested_s);

/// Judges a value by the tested range.
///
/// Beyond the lines that were printed nothing was measured: an interval that reaches past an edge
/// is no answer. 0 is no such edge, as no extruder leads: a range that begins there is tested down
/// to the end, and value and interval are cut off at 0.
/// @param half_width95_s  of the 95 % interval, >= 0
/// @param widest          largest half width, as a part of the tested range; > 0
/// @returns good; cannot-tell with the range to print next where the interval reaches past an edge,
///   cannot-tell with `too_wide` as its reason where it lies inside and is too wide.
[[nodiscard]] RangedAnswer JudgeInRange(double value_s, double standard_uncertainty_s,
                                        double half_width95_s, const Interval& tested_s,
                                        double widest, const std::string& too_wide);

}  // namespace trammel::pressure_advance

// Pressure advances and segments on the command line.
#pragma once

#include <string_view>
#include <vector>

#include "base/result.h"
#include "pressure_advance/profile/line_motion.h"

namespace trammel::app {

/// Reads `0,0.01,0.02`, `START:END:STEP` or `START:END:COUNT`, both ends included. The third part
/// is a step where it fits between the ends, else a count: 0:0.1:0.005 has 21 values, 0:0.06:10
/// has ten.
/// @returns At least one value, in s, rounded to 1e-9 s. Errors: not numbers, negative, above 10 s,
///          reversed, a step that does not divide the range, more than 1000 values.
[[nodiscard]] Result<std::vector<double>> ParsePressureAdvances(std::string_view text);

/// Reads `FRACTION:SPEED,FRACTION:SPEED,…`, for example 0.1:10,0.6:100,0.3:10.
/// @returns Segments whose fractions sum to 1 (to 1e-3) and whose speeds lie within 0.1 … 2000
///          mm/s, or an error that names the part and the bound.
[[nodiscard]] Result<std::vector<pressure_advance::Segment>> ParseSegments(std::string_view text);

}  // namespace trammel::app

// Pressure-advance values on the command line.
#pragma once

#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::app {

/// Reads `0,0.01,0.02`, `START:END:STEP` or `START:END:COUNT`, both ends included. The third part
/// is a step where it fits between the ends, else a count: 0:0.1:0.005 has 21 values, 0:0.06:10
/// has ten.
/// @returns At least one value, in s, rounded to 1e-9 s. Errors: not numbers, negative, above 10 s,
///          reversed, a step that does not divide the range, more than 1000 values.
[[nodiscard]] Result<std::vector<double>> ParsePressureAdvances(std::string_view text);

}  // namespace trammel::app

// From line profiles to the whole result: the response, and the paper's score beside it.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/response/response.h"

namespace trammel::pressure_advance {

/// Runs the response fit and puts everything known about the recording into one value.
/// @param deviation  of the heights that were seen; default-constructed where there are none (a
/// photo)
[[nodiscard]] Analysis Analyse(std::vector<LineProfile> profiles, const LineMotion& motion,
                               DeviationResult deviation, const ResponseOptions& options = {});

}  // namespace trammel::pressure_advance

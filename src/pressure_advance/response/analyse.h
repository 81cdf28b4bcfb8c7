// From line profiles to the whole result: both methods side by side, one of them in charge.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/response/response.h"
#include "pressure_advance/response/tested_range.h"

namespace trammel::pressure_advance {

/// Judges the paper's method as if it were a measurement: the cubic's minimum, with the uncertainty
/// that the scores' scatter about the cubic gives it and no less than that of the grid (step / sqrt
/// 12). The paper states no uncertainty; this one is for comparison.
/// @param pressure_advance_s  per line, same order as deviation.score_px
/// @returns also cannot-tell where the interval reaches past the tested range, or where the scores
///   fall towards one of its ends, with the range to print next.
[[nodiscard]] RangedAnswer JudgeDeviation(const DeviationResult& deviation,
                                          const std::vector<double>& pressure_advance_s);

/// Runs the response fit and puts everything known about the recording into one value.
/// @param deviation  from the eye that saw heights; default-constructed where there is none (a
/// photo),
///   in which case Method::kDeviation is refused.
[[nodiscard]] Analysis Analyse(std::vector<LineProfile> profiles, const LineMotion& motion,
                               DeviationResult deviation, Method method,
                               const ResponseOptions& options = {});

}  // namespace trammel::pressure_advance

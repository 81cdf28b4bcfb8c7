// One answer from the acceleration and the deceleration, with everything that is not known of it.
#pragma once

#include <string>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/response/fit_transitions.h"
#include "pressure_advance/response/response_options.h"
#include "pressure_advance/response/tested_range.h"

namespace trammel::pressure_advance {

struct CombinedTransitions {
  Measured acceleration;  ///< s, by itself
  Measured deceleration;  ///< s, by itself
  RangedAnswer both;
  std::vector<std::string> notices;
};

/// Weighs the two crossings by their covariance.
///
/// Uncertainty: the scatter of the lines by leaving out one at a time (the two transitions share
/// the lines, and with them each line's own lag); slip, which pulls the two in opposite directions;
/// filament that was not read and the form of the lag, which pull both the same way; and where the
/// two differ by more than twice what that explains, a rectangular distribution over the rest.
/// @param slope_has_scale  whether a slope of 1 means that all filament was seen.
/// @returns cannot-tell where a transition does not answer to PA, answers the wrong way round, may
///   lie outside the tested range, or is too uncertain; a transition that merely does not answer
///   leaves the other one to count alone, with a notice.
/// REQUIRES the same lines, at least two, in both series.
[[nodiscard]] CombinedTransitions CombineTransitions(const TransitionSeries& acceleration,
                                                     const TransitionSeries& deceleration,
                                                     const TransitionCrossings& crossings,
                                                     bool slope_has_scale,
                                                     const ResponseOptions& options);

}  // namespace trammel::pressure_advance

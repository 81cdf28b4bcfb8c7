// One answer from the acceleration and the deceleration, with everything that is not known of it.
#pragma once

#include <string>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/response/response_options.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

/// One transition of all usable lines, shape (lines) each, and the crossing fitted to it.
struct TransitionSeries {
  std::vector<double> pa_s;
  std::vector<double> excess_s;  ///< surplus filament over the speed change
  std::vector<double> sigma_s;   ///< 1 sigma of each
  /// How far a flow loss of 1 in the fast segment moves the excess: s.
  double slip_excess_s = 0;
  signal::ZeroCrossing crossing;
};

struct CombinedTransitions {
  Measured acceleration;  ///< s, by itself
  Measured deceleration;  ///< s, by itself
  Measured both;          ///< s
  std::vector<std::string> notices;
};

/// Weighs the two crossings by their covariance.
///
/// Uncertainty: the scatter of the lines by leaving out one at a time (the two transitions share
/// the lines, and with them each line's own lag); slip, which pulls the two in opposite directions;
/// filament that was not read and the form of the lag, which pull both the same way; and where the
/// two differ by more than twice what that explains, a rectangular distribution over the rest.
/// @param slope_has_scale  whether a slope of 1 means that all filament was seen.
/// @returns cannot-tell where a transition does not answer to PA, answers the wrong way round, lies
///   outside the tested range, or is too uncertain; a transition that merely does not answer leaves
///   the other one to count alone, with a notice.
/// REQUIRES the same lines, at least two, in both series.
[[nodiscard]] CombinedTransitions CombineTransitions(const TransitionSeries& acceleration,
                                                     const TransitionSeries& deceleration,
                                                     bool slope_has_scale,
                                                     const ResponseOptions& options);

}  // namespace trammel::pressure_advance

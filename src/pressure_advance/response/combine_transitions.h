// One answer from the acceleration and the deceleration, with everything that is not known of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/response/answer.h"
#include "pressure_advance/response/crossings.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// A value before it is judged.
struct BudgetedValue {
  double value_s = 0;
  UncertaintyBudget budget;
};

struct CombinedTransitions {
  Measured acceleration;            ///< s, its crossing less slip, the window's tail and drift
  Measured deceleration;            ///< s, in the same way
  double acceleration_shift_s = 0;  ///< its value less its crossing
  double deceleration_shift_s = 0;
  RangedAnswer both;
  std::vector<std::string> notices;
  /// What the three were judged from; nothing where both transitions do not answer.
  std::optional<BudgetedValue> whole, first, second;
  CrossingPair pair;
  Slip slip;           ///< that was taken out of first and second
  double freedom = 1;  ///< of the lines' scatter
  Interval tested;
  double widest = 0;  ///< half width of an interval, as a part of the tested range
};

/// Says that the two transitions contradict each other.
[[nodiscard]] std::string NoticeOfTransitions(double acceleration_s, double deceleration_s,
                                              double sigmas);

/// Weighs the two crossings by their covariance.
///
/// Slip pulls the two in opposite directions: their difference shows it. Filament that was not
/// read, the form of the lag and its drift pull both the same way; and where the two differ by more
/// than twice what the lines' scatter and slip explain, a rectangular distribution over the rest is
/// added.
/// @param slope_has_scale  whether a slope of 1 means that all filament was seen.
/// @returns cannot-tell where a transition does not answer to PA, answers the wrong way round, may
///   lie outside the tested range, or is too uncertain; a transition that merely does not answer
///   leaves the other one to count alone, with a notice.
/// REQUIRES the same lines, at least two, in all series, and crossings of these transitions.
[[nodiscard]] CombinedTransitions CombineTransitions(const Transitions& transitions,
                                                     const TransitionCrossings& crossings,
                                                     bool slope_has_scale,
                                                     const ResponseOptions& options);

}  // namespace trammel::pressure_advance

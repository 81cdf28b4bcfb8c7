// Combines acceleration and deceleration to one answer with its whole uncertainty.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/response/answer.h"
#include "pressure_advance/response/crossings.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// Value before the checks.
struct BudgetedValue {
  double value_s = 0;
  UncertaintyBudget budget;
};

struct CombinedTransitions {
  Measured acceleration;            ///< s, its crossing less slip, the window's tail and drift
  Measured deceleration;            ///< s, in the same way
  double acceleration_shift_s = 0;  ///< value less crossing
  double deceleration_shift_s = 0;
  RangedAnswer both;
  std::vector<std::string> notices;
  /// Input of the three answers; nothing if not both transitions yield one.
  std::optional<BudgetedValue> whole, first, second;
  CrossingPair pair;
  Slip slip;           ///< removed from first and second
  double freedom = 1;  ///< degrees of freedom of scatter
  Interval tested;
  double widest = 0;  ///< half width of an interval, as a part of the tested range
};

/// Returns the notice that the two transitions contradict each other.
[[nodiscard]] std::string NoticeOfTransitions(double acceleration_s, double deceleration_s,
                                              double sigmas);

/// Weights the two crossings by their covariance.
///
/// Slip shifts the two in opposite directions: their difference shows it. Unread filament, the form
/// of the lag and its drift shift both in the same direction. If the two differ by more than twice
/// what the lines' scatter and slip explain, a rectangular distribution over the rest is added.
/// @param slope_has_scale  true if a slope of 1 means that all filament was seen.
/// @returns cannot-tell if a transition does not respond to PA, responds with the wrong sign, may
///   be outside the tested range, or is too uncertain; if one merely does not respond,
///   the other counts alone, with a notice.
/// REQUIRES the same lines, at least two, in all series, and crossings of these transitions.
[[nodiscard]] CombinedTransitions CombineTransitions(const Transitions& transitions,
                                                     const TransitionCrossings& crossings,
                                                     bool slope_has_scale,
                                                     const ResponseOptions& options);

}  // namespace trammel::pressure_advance

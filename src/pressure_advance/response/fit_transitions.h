// Zero crossings of both transitions of the same lines.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/response/response_options.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

/// One transition of all usable lines, shape (lines) each.
struct TransitionSeries {
  std::vector<double> pa_s;
  std::vector<double> excess_s;  ///< surplus filament over the speed change
  std::vector<double> sigma_s;   ///< 1 sigma of each
  /// How far a flow loss of 1 in the fast segment moves the excess: s.
  double slip_excess_s = 0;
};

struct TransitionCrossings {
  signal::ZeroCrossing acceleration;
  signal::ZeroCrossing deceleration;
};

/// Fits each transition's crossing by itself.
/// @returns nothing where fewer than three lines have different pressure advance.
/// REQUIRES the same lines in both series.
[[nodiscard]] std::optional<TransitionCrossings> FitTransitions(
    const TransitionSeries& acceleration, const TransitionSeries& deceleration,
    const ResponseOptions& options);

}  // namespace trammel::pressure_advance

// Zero crossings of both transitions of the same lines.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/response/paired_difference.h"
#include "pressure_advance/response/response_options.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

/// One transition of all usable lines, shape (lines) each.
struct TransitionSeries {
  std::vector<double> pa_s;
  std::vector<double> excess_s;  ///< surplus filament over the speed change
  std::vector<double> sigma_s;   ///< 1 sigma of each; infinite where a line does not show it
  /// How far a flow loss of 1 in the fast segment moves the excess: s.
  double slip_excess_s = 0;

  /// Pressure advance of the lines that show it.
  [[nodiscard]] std::vector<double> SeenPa_s() const;
  /// How far a crossing lies beyond the lines that show this transition; 0 where all do.
  [[nodiscard]] double Beyond_s(double zero_s) const;
};

/// Both transitions of the same lines.
struct Transitions {
  TransitionSeries acceleration;
  TransitionSeries deceleration;
  /// The acceleration over a window that ends earlier; nothing where the tail has passed by then.
  std::optional<TransitionSeries> early;
  double ramp_s = 0;        ///< duration of the acceleration; 0 where unknown
  double drain_s = 0;       ///< from its end to its window's, at the fast speed
  double slow_drain_s = 0;  ///< from the second change to its window's end, at the slow speed
};

struct TransitionCrossings {
  signal::ZeroCrossing acceleration;
  signal::ZeroCrossing deceleration;
  std::optional<signal::ZeroCrossing> early;
  /// Where both windows share the fast stretch and the excesses' scale is known.
  std::optional<PairedDifference> paired;

  /// Crossing of the early window less that of the whole one: what is still to come of it tells how
  /// far the window's end moved both crossings. 0 without an early window.
  [[nodiscard]] double tail_s() const { return early ? early->zero - acceleration.zero : 0; }
};

/// Fits each transition's crossing by itself, and what the two of one line differ by.
/// Lines that do not show a transition have no weight and no influence there.
/// @returns nothing where fewer than three lines that show it have different pressure advance.
/// REQUIRES the same lines in all series.
[[nodiscard]] std::optional<TransitionCrossings> FitTransitions(const Transitions& transitions,
                                                                const ResponseOptions& options);

}  // namespace trammel::pressure_advance

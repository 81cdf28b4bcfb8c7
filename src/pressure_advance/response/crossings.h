// Fits the zero crossings of both transitions' surplus, with their covariance.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/response/response_options.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

/// Returns the part of the filament that a speed change moves through a linear lag and that is laid
/// down within the acceleration's window: 1 - lag m(end) / dv, with dm/dt = (acceleration - m /
/// lag).
/// @param lag_s    > 0
/// @param ramp_s   duration of the speed change, > 0
/// @param drain_s  from its end to the window's, at the fast speed; >= 0
/// @returns 0 … 1
[[nodiscard]] double GainOfALinearLag(double lag_s, double ramp_s, double drain_s);

/// Change of the lag over the tested range, relative to that range, for lines ordered by pressure
/// advance: positive if lines with more of it lag more.
struct LagDrift {
  double mean = 0;
  double sigma = 0;  ///< 1 sigma
};

/// Estimates the drift from a slope of the response that differs from the window's gain.
///
/// A drift multiplies the slope by 1 - drift. The gain is between that of a linear lag and 1; if
/// the tail shows no thinning, near the former.
/// @param slope        of the response, > 0
/// @param slope_sigma  1 sigma
/// @param linear_gain  GainOfALinearLag of the answer
/// @param tail         of the crossing between a shorter window and the whole one, relative to it
[[nodiscard]] LagDrift EstimateLagDrift(double slope, double slope_sigma, double linear_gain,
                                        double tail, const LagDriftOptions& options);

struct TransitionSeries;
struct PairedDifference;

/// Fits the differences of all lines together.
///
/// Filament is conserved: on lines with too little pressure advance the two surpluses differ only
/// by slip and by the parts cut off at the windows' ends. Beyond the answer a gap's filament may be
/// lost. A drive loses filament and creates none: a difference below 0 by more than its sigma is
/// attributed to gaps that reach into the windows of lines below the answer, too, and cut off
/// there.
/// @param zero_s  the acceleration's crossing, less the window's tail
/// @param slope   of the acceleration's response, > 0
/// @param share   of the difference contained in the acceleration's crossing, 0 … 1
/// REQUIRES the same lines in both series.
[[nodiscard]] PairedDifference FitPairedDifference(const TransitionSeries& acceleration,
                                                   const TransitionSeries& deceleration,
                                                   double zero_s, double slope, double share,
                                                   const PairedOptions& options);

/// Surplus of the acceleration minus that of the deceleration of one line, at the right pressure
/// advance.
struct PairedDifference {
  double value_s = 0;
  double sigma_s = 0;             ///< 1 sigma from the lines' scatter
  double form_s = 0;              ///< 1 sigma from what the priors leave open of its form
  bool cut_off = false;           ///< it lay too far below 0
  std::vector<double> fitted_s;   ///< each line's difference on the fit
  std::vector<double> influence;  ///< change of the value per line's residual of 1

  [[nodiscard]] double variance() const { return sigma_s * sigma_s + form_s * form_s; }
};

/// One transition of all usable lines, shape (lines) each.
struct TransitionSeries {
  std::vector<double> pa_s;
  std::vector<double> surplus_s;  ///< surplus filament over the speed change
  std::vector<double> sigma_s;    ///< 1 sigma of each; infinite where a line does not show it
  /// Shift of the surplus by a flow loss of 1 in the fast segment, s.
  double slip_surplus_s = 0;

  /// Returns the pressure advance of the lines that show the transition.
  [[nodiscard]] std::vector<double> SeenPa_s() const;
  /// Computes the distance of a crossing from the lines that show this transition; 0 if all do.
  [[nodiscard]] double Beyond_s(double zero_s) const;
};

/// Both transitions of the same lines.
struct Transitions {
  TransitionSeries acceleration;
  TransitionSeries deceleration;
  /// Acceleration over a window that ends earlier; absent if the tail has passed by then.
  std::optional<TransitionSeries> early;
  double ramp_s = 0;        ///< duration of the acceleration; 0 where unknown
  double drain_s = 0;       ///< end of the ramp to end of its window, at the fast speed
  double slow_drain_s = 0;  ///< second change to its window's end, at the slow speed
};

struct TransitionCrossings {
  signal::ZeroCrossing acceleration;
  signal::ZeroCrossing deceleration;
  std::optional<signal::ZeroCrossing> early;
  /// Present if both windows share the fast stretch and the surpluses' scale is known.
  std::optional<PairedDifference> paired;

  /// Returns the crossing of the early window minus that of the whole one: the remaining tail shows
  /// how far the window's end moved both crossings. 0 without an early window.
  [[nodiscard]] double tail_s() const { return early ? early->zero - acceleration.zero : 0; }
};

/// Fits each transition's crossing separately, and the difference of the two per line. Lines that
/// do not show a transition have no weight and no influence there.
/// @returns nothing if fewer than three lines that show it have different pressure advance.
/// REQUIRES the same lines in all series.
[[nodiscard]] std::optional<TransitionCrossings> FitTransitions(const Transitions& transitions,
                                                                const ResponseOptions& options);

/// Shifts of a crossing by causes common to all lines, which leaving lines out cannot show: by one
/// standard deviation each, s.
struct CommonShifts {
  double slip = 0;    ///< opposite for the two transitions
  double unread = 0;  ///< filament beside what was read
  double form = 0;    ///< from the lag's model, not resolved by the window
};

/// Corrected crossing of one transition.
struct CorrectedCrossing {
  double zero_s = 0;
  double variance = 0;  ///< from line scatter and the curvature of the response, s^2
  CommonShifts common;
};

struct CrossingPair {
  CorrectedCrossing acceleration;
  CorrectedCrossing deceleration;
  double covariance = 0;  ///< between both, from the scatter of the lines, s^2
  double tail_s = 0;      ///< acceleration's tail, weighted with prior knowledge
  double tail_share = 0;  ///< share of the observed tail that was subtracted from both
  double own_share = 1;   ///< weight of the deceleration's own fit in its crossing
};

/// Removes the window's tail from both crossings (ResponseOptions::tail_share of it), and estimates
/// their covariance from each line's influence on them: the two transitions share the lines and so
/// each line's own lag. The deceleration's crossing is the mean, weighted by variances, of its own
/// fit and of the acceleration's minus the lines' paired difference, if there is one; only the
/// latter if filament was lost before the answer (PairedDifference::cut_off).
///
/// The tail is weighted against its prior, so that a noisy tail neither shifts nor widens the
/// result.
/// @param slope_has_scale  true if a slope of 1 means that all filament was seen
/// REQUIRES crossings of these transitions.
[[nodiscard]] CrossingPair CorrectCrossings(const Transitions& transitions,
                                            const TransitionCrossings& crossings,
                                            bool slope_has_scale, const ResponseOptions& options);

/// Variances and covariance of both corrected crossings from the scatter of the lines, s^2.
struct PairVariances {
  double acceleration = 0;
  double deceleration = 0;
  double covariance = 0;
};

/// Estimates the variances from each line's influence on the crossings by its difference from the
/// line that the model lays in its place.
/// @param laid  of the same lines as `seen`, as laid by a model
/// REQUIRES crossings and pair of `seen`.
[[nodiscard]] PairVariances ScatterAbout(const Transitions& laid, const Transitions& seen,
                                         const TransitionCrossings& crossings,
                                         const CrossingPair& pair);

/// Slip from the crossings' difference, in units of ResponseOptions::slip_sigma.
struct Slip {
  double mean = 0;
  double variance = 1;
  /// Parts of the difference: subtracted from the acceleration's crossing for it, and added to the
  /// deceleration's.
  double off_acceleration = 0;
  double on_deceleration = 0;
};

/// Weights the difference against its prior of 0 ± 1.
[[nodiscard]] Slip EstimateSlip(const CrossingPair& pair);

/// Computes the variances of both crossings less slip, from the lines' scatter: each has a share of
/// the other's.
[[nodiscard]] PairVariances LessSlip(const PairVariances& lines, const Slip& slip);

}  // namespace trammel::pressure_advance

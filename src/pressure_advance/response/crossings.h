// Fits where the surplus of both transitions crosses zero, with their covariance.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/response/response_options.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

/// Part of the filament that a speed change moves through a linear lag and that is laid down within
/// the acceleration's window: 1 - lag m(end) / dv, with dm/dt = (acceleration - m / lag).
/// @param lag_s    > 0
/// @param ramp_s   duration of the speed change, > 0
/// @param drain_s  from its end to the window's, at the fast speed; >= 0
/// @returns 0 … 1
[[nodiscard]] double GainOfALinearLag(double lag_s, double ramp_s, double drain_s);

/// Change of the lag over the tested range, relative to that range, as lines in the order of their
/// pressure advance show it: positive where lines with more of it lag more.
struct LagDrift {
  double mean = 0;
  double sigma = 0;  ///< 1 sigma
};

/// Estimates the drift: a slope of the response other than the gain that the window leaves.
///
/// A drift multiplies the slope by 1 - drift. The gain lies between that of a linear lag and 1;
/// where the tail shows no thinning, near the former.
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
/// Filament is conserved: on lines with too little pressure advance the two excesses differ by what
/// slipped and by what the windows' ends cut off, and by nothing else. Beyond the answer a gap's
/// filament may be lost. A drive loses filament and makes none: a difference below 0 by more than
/// its sigma is taken for gaps that reach into the windows of lines below the answer, too, and
/// cut off there.
/// @param zero_s  the acceleration's crossing, less the window's tail
/// @param slope   of the acceleration's response, > 0
/// @param share   of the difference that stands in the acceleration's crossing, 0 … 1
/// REQUIRES the same lines in both series.
[[nodiscard]] PairedDifference FitPairedDifference(const TransitionSeries& acceleration,
                                                   const TransitionSeries& deceleration,
                                                   double zero_s, double slope, double share,
                                                   const PairedOptions& options);

/// Excess of the acceleration less that of the deceleration of one line, where its pressure advance
/// is right.
struct PairedDifference {
  double value_s = 0;
  double sigma_s = 0;             ///< 1 sigma from the lines' scatter
  double form_s = 0;              ///< 1 sigma from what the priors leave open of its form
  bool cut_off = false;           ///< it lay too far below 0
  std::vector<double> fitted_s;   ///< each line's difference on the fit
  std::vector<double> influence;  ///< by how far a line's residual of 1 moves the value

  [[nodiscard]] double variance() const { return sigma_s * sigma_s + form_s * form_s; }
};

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

/// Shifts of a crossing by what every line shares, so that leaving lines out does not show it: by
/// one standard deviation each, s.
struct CommonShifts {
  double slip = 0;    ///< opposite for the two transitions
  double unread = 0;  ///< filament beside what was read
  double form = 0;    ///< of the lag's law, as far as the window leaves it open
};

/// One transition's crossing.
struct CorrectedCrossing {
  double zero_s = 0;
  double variance = 0;  ///< from the scatter of the lines and the bend of the response, s^2
  CommonShifts common;
};

struct CrossingPair {
  CorrectedCrossing acceleration;
  CorrectedCrossing deceleration;
  double covariance = 0;  ///< of the two, from the scatter of the lines, s^2
  double tail_s = 0;      ///< of the acceleration, weighed against what is known of it beforehand
  double tail_share = 0;  ///< of the tail as it is seen, that was taken off both
  double own_share = 1;   ///< of the deceleration's own fit in its crossing
};

/// Takes the window's tail out of both crossings (ResponseOptions::tail_share of it), and finds
/// their covariance by how far each line moved them: the two transitions share the lines, and with
/// them each line's own lag. The deceleration's crossing is weighed from its own fit and from the
/// acceleration's less the lines' paired difference, where there is one: by their variances, and
/// the latter alone where filament was lost before the answer (PairedDifference::cut_off).
///
/// The tail is weighed against its prior, so that a noisy one moves and widens nothing.
/// @param slope_has_scale  whether a slope of 1 means that all filament was seen
/// REQUIRES crossings of these transitions.
[[nodiscard]] CrossingPair CorrectCrossings(const Transitions& transitions,
                                            const TransitionCrossings& crossings,
                                            bool slope_has_scale, const ResponseOptions& options);

/// What the scatter of the lines leaves open of both corrected crossings, and together, s^2.
struct PairVariances {
  double acceleration = 0;
  double deceleration = 0;
  double covariance = 0;
};

/// Measures it by how far each line moves the crossings for what it has more than a line that is
/// laid in its place.
/// @param laid  of the same lines as `seen`, as a law lays them
/// REQUIRES crossings and pair of `seen`.
[[nodiscard]] PairVariances ScatterAbout(const Transitions& laid, const Transitions& seen,
                                         const TransitionCrossings& crossings,
                                         const CrossingPair& pair);

/// Slip as the crossings' difference shows it, in units of ResponseOptions::slip_sigma.
struct Slip {
  double mean = 0;
  double variance = 1;
  /// Of the difference: what was taken off the acceleration's crossing for it, and put on the
  /// deceleration's.
  double off_acceleration = 0;
  double on_deceleration = 0;
};

/// Weighs the difference against its prior of 0 ± 1.
[[nodiscard]] Slip EstimateSlip(const CrossingPair& pair);

/// What the scatter of the lines leaves open of both crossings less slip: each has a share of the
/// other's.
[[nodiscard]] PairVariances LessSlip(const PairVariances& lines, const Slip& slip);

}  // namespace trammel::pressure_advance

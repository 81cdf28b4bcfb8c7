// The two crossings of the same lines, less what the windows' end moved them, with their
// covariance.
#pragma once

#include "pressure_advance/response/fit_transitions.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

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

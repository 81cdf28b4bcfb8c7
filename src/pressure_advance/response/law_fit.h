// Learns the law of the lag from whole profiles, and weighs it with the crossings.
#pragma once

#include <optional>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/combine_transitions.h"
#include "pressure_advance/response/lag_model.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// A value that a fit gives, with what its own model leaves open.
struct Fitted {
  double value = 0;
  double sigma = 0;  ///< 1 sigma
};

struct LawFit {
  double pressure_advance_s = 0;  ///< right for the mean line
  double sigma_s = 0;             ///< 1 sigma, of lines of the model
  Fitted slow_lag_s;              ///< of a small change at the slow speed (LagModel::LagAt) …
  Fitted fast_lag_s;              ///< … and at the fast one
  Fitted slip;                    ///< share of the drive lost at the fast flow
  Lag lag;
  double level = 0;          ///< area of an even bead, in the profiles' unit
  double tilt = 0;           ///< relative change of that over a line
  double swell = 0;          ///< share of a bead's surplus that is read too much
  double power = 0;          ///< of a bead's area that is read, less one
  double place_mm = 0;       ///< by which the bead read lies further along the axis of the bed
  double drift = 0;          ///< of the lag over the tested range, relative
  double middle_s = 0;       ///< mean of the tested values, where the lag is the mean line's …
  double range_s = 0;        ///< … and their range
  double lag_scatter_s = 0;  ///< from line to line, 1 sigma
  /// Correlation of what neighbouring lines differ by from the law, at the same place: near 0 where
  /// the extruder follows it.
  double shared_misfit = 0;
  int lines = 0;
};

/// The same lines as the learnt law lays them, and as they are read.
[[nodiscard]] std::vector<LineProfile> LayLines(const LawFit& law,
                                                std::vector<LineProfile> profiles,
                                                const LineMotion& motion);

/// Fits lag, law, slip, drift and what the reading adds, to all readings of all lines together
/// (Gauss-Newton). A line's own lag and level, a flow that wanders, filament that spreads along the
/// line or parts into drops stand in the readings' covariance; how much lags and levels scatter and
/// how well readings repeat is learnt of the same lines. A reading that does not fit its neighbours
/// counts less.
/// @param lag_s    a first guess
/// @param span_mm  of the positions that are looked at
/// @returns nothing where fewer than four lines can be used, or no number comes of them.
/// REQUIRES areas over mm, and a motion with length and acceleration, slow, fast, slow.
[[nodiscard]] std::optional<LawFit> FitLaw(const std::vector<LineProfile>& profiles,
                                           const LineMotion& motion, double lag_s,
                                           const Interval& span_mm, const LawOptions& options = {});

/// How much a law counts by what it leaves over of the lines: 1 up to trusted_misfit, falling to 0
/// at refuted_misfit.
[[nodiscard]] double TrustIn(const LawFit& law, const LawOptions& options);

/// Takes out of the crossings what the same fit errs by on lines that the learnt law lays, and
/// weighs the result with the law's own value by their variances; the law's own error is in both.
/// Both count by the trust in the law, and a part of what it moves the answer by stays open. Where
/// the two, or the transitions after that, differ by more than twice what is known of them
/// explains, the rest enters as a rectangular distribution, with a notice.
/// @returns what each of the two says and by how much it counts; without lines
/// @param twin  of the mirrored lines: their scatter, and what the law does to the
///   fit, are the same
/// REQUIRES whole, first and second in both.
LearntLaw WeighWithLaw(const LawFit& law, const CombinedTransitions& twin,
                       const LawOptions& options, CombinedTransitions& crossings);

}  // namespace trammel::pressure_advance

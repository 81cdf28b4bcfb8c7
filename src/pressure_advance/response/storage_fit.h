// Fits the storage model to whole profiles, and weights it with the crossings.
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

/// Fitted value, with the uncertainty of its own model.
struct Fitted {
  double value = 0;
  double sigma = 0;  ///< 1 sigma
};

struct StorageFit {
  double pressure_advance_s = 0;  ///< right for the mean line
  double sigma_s = 0;             ///< 1 sigma, of lines of the model
  Fitted slow_lag_s;              ///< small change at the slow speed (LagModel::LagAt) …
  Fitted fast_lag_s;              ///< … and at the fast one
  Fitted slip;                    ///< share of the drive lost at the fast flow
  Lag lag;
  double level = 0;          ///< area of an even bead, in the profiles' unit
  double tilt = 0;           ///< relative change of that over a line
  double swell = 0;          ///< share of a bead's surplus that is read too much
  double power = 0;          ///< exponent of the bead area as read, less one
  double place_mm = 0;       ///< shift of the bead as read along its bed axis
  double drift = 0;          ///< of the lag over the tested range, relative
  double middle_s = 0;       ///< mean of the tested values, where the lag is the mean line's …
  double range_s = 0;        ///< … and their range
  double lag_scatter_s = 0;  ///< from line to line, 1 sigma
  /// Correlation of neighbouring lines' residuals from the model, at the same position: near 0 if
  /// the extruder follows it.
  double shared_misfit = 0;
  int lines = 0;
};

/// Returns the same lines as laid by the fitted model, and as read.
[[nodiscard]] std::vector<LineProfile> LayLines(const StorageFit& law,
                                                std::vector<LineProfile> profiles,
                                                const LineMotion& motion);

/// Fits lag, law, slip, drift and the reading's errors to all readings of all lines together
/// (Gauss-Newton). A line's own lag and level, a wandering flow, and filament that spreads along
/// the line or separates into drops enter the readings' covariance. The scatter of lags and levels
/// and the readings' repeatability are estimated from the same lines. A reading that does not fit
/// its neighbours has less weight.
/// @param lag_s    a first guess
/// @param span_mm  of the positions used
/// @returns nothing if fewer than four lines are usable, or no finite number results.
/// REQUIRES areas over mm, and a motion with length and acceleration, slow, fast, slow.
[[nodiscard]] std::optional<StorageFit> FitStorage(const std::vector<LineProfile>& profiles,
                                                   const LineMotion& motion, double lag_s,
                                                   const Interval& span_mm,
                                                   const StorageOptions& options = {});

/// Computes a storage model's weight from its misfit of the lines: 1 up to trusted_misfit, falling
/// to 0 at refuted_misfit.
[[nodiscard]] double TrustIn(const StorageFit& law, const StorageOptions& options);

/// Corrects the crossings by the same fit's error on lines laid by the fitted model, and weights
/// the result with the model's own value by their variances; the model's own error is in both. Both
/// are weighted by the trust in the model, and a part of its effect on the answer remains as
/// uncertainty. If the two, or the transitions after that, differ by more than twice their
/// explained uncertainty, the rest enters as a rectangular distribution, with a notice.
/// @returns the value and weight of each of the two; without lines
/// @param twin  of the mirrored lines: their scatter, and the model's effect on the
///   fit, are the same
/// REQUIRES whole, first and second in both.
WeighedStorage WeighWithStorage(const StorageFit& law, const CombinedTransitions& twin,
                                const StorageOptions& options, CombinedTransitions& crossings);

}  // namespace trammel::pressure_advance

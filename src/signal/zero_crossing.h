// Crossing of zero by a falling response.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace trammel::signal {

/// y = -slope * ((x - zero) + bend * |x - zero|): two half-lines that meet at the answer, falling
/// at slope * (1 - bend) before it and slope * (1 + bend) after it. The bend models a response that
/// saturates on one side (a gap cannot become emptier than empty), so that this side does not shift
/// the crossing.
struct ZeroCrossingOptions {
  double bend_mean = 0;  ///< prior mean of the bend, within (-0.8, 0.8), as the bend itself
  /// Prior standard deviation of the bend, > 0. 0.06: the slopes before and after the answer,
  /// 1 - bend and 1 + bend, differ by about 12 % (1 sigma).
  double bend_sigma = 0.06;
  /// The straight halves' error grows with the distance from the answer: this fraction of slope *
  /// |x - zero| is added to each point's sigma, so that near points decide if they can.
  double distance_sigma = 0.08;
  /// Lets the response become constant beyond some x after the crossing, as when gaps are complete;
  /// points there are only upper bounds.
  bool may_saturate = false;
  double outlier_scale = 6;   ///< Tukey's biweight: points this many scales away count nothing
  double scale_floor = 1e-6;  ///< smallest scale of the residuals, in y; > 0
};

struct ZeroCrossing {
  double zero = 0;
  double slope = 0;  ///< > 0 for a falling response
  double bend = 0;
  double cut = 0;                 ///< beyond it the response is constant; infinite where nowhere
  double floor = 0;               ///< constant response
  std::size_t saturated = 0;      ///< number of points on the constant part
  double residual_scale = 0;      ///< robust standard deviation of y about the fit
  double points = 0;              ///< effective number of points, in units of the heaviest
  double slope_sigma = 0;         ///< 1 sigma of slope from the residuals
  double zero_sigma = 0;          ///< 1 sigma of zero from the residuals
  double bend_shift = 0;          ///< the same from what the prior leaves open of the bend
  std::vector<double> fitted;     ///< at each x
  std::vector<double> weight;     ///< robust weight in [0, 1] of each point
  std::vector<double> influence;  ///< d zero / d y of each point, at these weights
};

/// Returns the fitted response at x.
[[nodiscard]] double ResponseAt(const ZeroCrossing& fit, double x);

/// Fits the two half-lines by iteratively reweighted least squares (Huber, then Tukey's biweight).
/// The crossing is found by an exhaustive search over the range of x and half of it on either side,
/// so that no start value is needed.
///
/// @param x, y   equally long, at least 3 points with at least 3 different x.
/// @param sigma  known 1 sigma of each y beside the common scatter, >= 0; same length.
/// @returns nothing if the x do not differ enough.
[[nodiscard]] std::optional<ZeroCrossing> FitZeroCrossing(std::span<const double> x,
                                                          std::span<const double> y,
                                                          std::span<const double> sigma,
                                                          const ZeroCrossingOptions& options);

}  // namespace trammel::signal

// End of the press: a point, and the interval of all that the data and the form of the press
// permit.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "tap/contact/break_models.h"
#include "tap/contact/press_profile.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Best press for the samples, in the units of BreakSamples: c1 d + c2 d^2 + c3 d^3, or a power of
/// the depth d below t, or two zones with a kink between them.
struct PressShape {
  double t = 0;
  std::array<double, 3> c{};
  double power_c = 0;
  double power = 1;
  double kink_t = 0;
  double added_slope = 0;
  double added_curve = 0;

  /// Computes the force at a height, without the baseline; 0 above t.
  [[nodiscard]] double At(double y) const {
    const double d = t - y;
    if (!(d > 0)) {
      return 0;
    }
    const double e = std::max(0.0, kink_t - y);
    const double by_power = power_c != 0 ? power_c * std::pow(d, power) : 0;
    return d * (c[0] + d * (c[1] + d * c[2])) + by_power + e * (added_slope + e * added_curve);
  }
  /// Returns the derivative by y, <= 0 for a press; that of a power below 1 is bounded near t.
  [[nodiscard]] double Slope(double y) const;
  /// Computes the mean slope over the last quarter of the depth.
  [[nodiscard]] double OuterSlope() const;
};

/// Break in the units of BreakSamples.
struct BreakEstimate {
  enum class Outcome : std::uint8_t {
    kFound,
    kTooFew,   ///< Samples, or the workspace was too small.
    kNoPress,  ///< No break point leaves a press that grows with depth.
    kAtEdge,   ///< The interval runs into the edge of the samples.
  };
  Outcome outcome = Outcome::kTooFew;
  double t = 0;
  double standard_uncertainty = 0;  ///< of t; includes the uncertainty of the press's form
  double lo = 0;                    ///< 95 % interval.
  double hi = 0;
  double noise = 0;        ///< Standard deviation of a sample about the model that fits best.
  std::size_t below = 0;   ///< Samples in the press.
  std::size_t order = 2;   ///< of the press to draw: 2, or 3 if the samples require it
  double quadratic_t = 0;  ///< The answers of the models,
  double cubic_t = 0;      ///< of this one NaN if it is excluded,
  double power_t = 0;      ///< and of this one.
  double outer_ratio =
      1;                  ///< Slope of an outer zone over the inner one's, where the press has two.
  PressShape shape;       ///< press that fits the samples best
  Candidates candidates;  ///< The models' answers, for a BreakTask.
};

struct BreakTask {
  double inflation = 1;  ///< By which correlation of the noise raises the variance of means; >= 1.
  /// False: the point may be outside the interval or at the samples' edge, for a fit whose
  /// residuals alone are of interest.
  bool interval = true;
};

/// Estimates the break. Models: the quadratic press is the estimate. Its neighbours are the
/// straight one, the cubic one and a power law. The first is contained in it; a single tap cannot
/// separate the others from it until they err by several of its standard deviations.
///
/// Point: the quadratic press's break, moved towards a neighbour's by its Akaike weight (Burnham &
/// Anderson 2002, section 2.9). Cubic and power law must explain the samples much better
/// (kCubicPoint, kPowerPoint) because their breaks scatter more.
///
/// Interval: all break points whose sum of squares, under any model, is within the square of
/// Student's quantile of the minimum: the profile likelihood interval of the discrete profiling
/// method (Dauncey, Kenzie, Wardle & Davies 2015, JINST 10 P04015), with a penalty per model. It is
/// read off the profile itself, so a skewed profile yields a skewed interval. If one model holds,
/// its own part of the interval covers 95 %; a neighbour can only add on one side, which bounds the
/// excess at 2.5 %.
[[nodiscard]] BreakEstimate EstimateBreak(const PressProfile& profile, const BreakTask& task,
                                          Workspace& workspace);

}  // namespace trammel::tap

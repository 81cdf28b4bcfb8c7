// What many taps say together: how well they repeat, which stand apart, whether they drift.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/measured.h"

namespace trammel::tap {

/// One tap of many. NaN where something is not known.
struct TapResult {
  bool good = false;  ///< The verdict; z_mm and its uncertainty count only then.
  double z_mm = 0;
  double standard_uncertainty_mm = 0;
  double time_s = 0;  ///< Of the contact, on a clock that all taps share.
  double temperature_c = std::numeric_limits<double>::quiet_NaN();
  double x_mm = std::numeric_limits<double>::quiet_NaN();
  double y_mm = std::numeric_limits<double>::quiet_NaN();
};

struct EnsembleOptions {
  /// Taps nearer to each other are at one place, mm. A head comes back to some 10 um.
  double same_place_mm = 0.1;
  /// A tap is an outlier farther than this many robust standard deviations from the others
  /// (Iglewicz & Hoaglin 1993: 3.5 on the scale of the median absolute deviation).
  double outlier_deviations = 3.5;
};

/// A straight line through the heights, against time or temperature.
struct Trend {
  double slope = 0;  ///< mm per s, or per degC
  double standard_uncertainty = 0;
  Interval interval95;       ///< Student's t with the degrees of freedom that are left.
  bool significant = false;  ///< The interval does not hold 0.
};

/// What was found at one place of the bed.
struct Place {
  double x_mm = 0;  ///< NaN where taps say no place.
  double y_mm = 0;
  std::size_t taps = 0;  ///< Used ones.
  double z_mm = 0;       ///< Their mean.
  /// Of the mean; from the scatter where there are several taps, never below what they claim.
  double standard_uncertainty_mm = 0;
};

/// Scatter is that about the mean of each place, so that a mesh's shape is no scatter. Numbers that
/// need more taps than there are, are NaN.
struct Ensemble {
  std::size_t taps = 0;
  std::size_t good = 0;
  std::size_t used = 0;               ///< Good and no outlier.
  std::vector<std::size_t> outliers;  ///< Which of the taps, from 0.
  double range_mm = 0;                ///< The largest minus the smallest, at the worst place.
  double standard_deviation_mm = 0;   ///< Pooled over places.
  double mean_step_mm = 0;            ///< Mean size of the step from a tap to the next one there.
  double predicted_deviation_mm = 0;  ///< What the taps' own uncertainties promise (rms).
  std::optional<Trend> with_time;
  std::optional<Trend> with_temperature;
  std::vector<Place> places;  ///< In the order of their first tap.
};

/// @param taps  in the order of time; taps that are not good only count.
/// Outliers are judged against their place's median, after a drift that all taps share (Theil-Sen,
/// which up to 29 % of outliers do not bend) is taken off, and only where a place has five taps.
/// Cost: O(n log n), and O(m^2) in the taps of a place that the drift is read from, at most 400.
[[nodiscard]] Ensemble Summarise(std::span<const TapResult> taps,
                                 const EnsembleOptions& options = {});

}  // namespace trammel::tap

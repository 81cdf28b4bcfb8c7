// Statistics of many taps: repeatability, outliers, drift.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/measured.h"

namespace trammel::tap {

/// One tap of many. NaN: unknown.
struct TapResult {
  Measured z_mm;
  double time_s = 0;  ///< contact time, on a clock common to all taps
  double temperature_c = std::numeric_limits<double>::quiet_NaN();
  double x_mm = std::numeric_limits<double>::quiet_NaN();
  double y_mm = std::numeric_limits<double>::quiet_NaN();
};

/// Maximum distance of taps at one place, mm. A head returns to some 10 um.
inline constexpr double kSamePlace_mm = 0.1;

/// Straight line through the heights, against time or temperature.
struct Trend {
  Quantity slope;            ///< mm per s, or per degC; Student's t for the interval.
  bool significant = false;  ///< The interval does not hold 0.
};

/// Result at one place of the bed.
struct Place {
  double x_mm = 0;  ///< NaN where taps say no place.
  double y_mm = 0;
  std::size_t taps = 0;  ///< Used ones.
  /// Mean of the taps; its uncertainty is from the scatter if there are several, never below their
  /// own. Student's t for the interval, which a single tap does not have (NaN).
  Quantity z_mm;
};

/// Results of many taps. Scatter is about the mean of each place, so a mesh's shape is no scatter.
/// Numbers that need more taps are NaN.
struct Ensemble {
  std::size_t taps = 0;
  std::size_t good = 0;
  std::size_t used = 0;               ///< Good and no outlier.
  std::vector<std::size_t> outliers;  ///< indices of taps, from 0
  double range_mm = 0;                ///< The largest minus the smallest, at the worst place.
  double standard_deviation_mm = 0;   ///< Pooled over places.
  double mean_step_mm = 0;            ///< Mean size of the step from a tap to the next one there.
  double predicted_deviation_mm = 0;  ///< predicted by the taps' own uncertainties (rms)
  std::optional<Trend> with_time;
  std::optional<Trend> with_temperature;
  std::vector<Place> places;  ///< sorted by first tap
};

/// @param taps  in the order of time; taps that are not good only count.
/// Outliers are judged against their place's median, after a drift that all taps share (Theil-Sen,
/// which up to 29 % of outliers do not bend) is taken off, and only where a place has five taps.
/// Cost: O(n log n), and O(m^2) in the taps of a place that the drift is read from, at most 400.
[[nodiscard]] Ensemble Summarise(std::span<const TapResult> taps);

/// Groups the indices of good taps by place, in the order of their first tap. Taps without a place
/// form one group. Cost: O(n log n).
[[nodiscard]] std::vector<std::vector<std::size_t>> GroupByPlace(std::span<const TapResult> taps);

}  // namespace trammel::tap

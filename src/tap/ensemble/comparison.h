// Compares the repeatability of series of taps: two methods on the same taps, or the taps of
// several files.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "tap/ensemble/ensemble.h"

namespace trammel::tap {

/// Taps of one row of the table, in the order of time.
struct TapSeries {
  std::string name;
  std::vector<TapResult> taps;
};

/// Repeatability of a series' heights, about the mean of each place.
struct SeriesScatter {
  std::string name;
  std::size_t taps = 0;
  std::size_t good = 0;
  std::size_t used = 0;     ///< Good ones at a place that has two of them, outliers among them.
  double claimed_mm = 0;    ///< The taps' own standard uncertainties (rms); NaN without a tap.
  double mean_step_mm = 0;  ///< like Ensemble's: excludes slow drift
  Measured deviation_mm;    ///< Standard deviation, pooled over the places.
  Measured ratio;           ///< deviation_mm divided by that of the first series.
};

/// Minimum degrees of freedom (taps minus places): with fewer, the interval of a ratio spans more
/// than a factor of four.
inline constexpr double kMinComparisonFreedom = 8;

/// Compares each series with the first.
///
/// Intervals of a deviation are those of normal heights (1 / sqrt(2 f) in its logarithm) or, where
/// wider, the jackknife's over taps, which heavy tails widen (Miller 1968). A ratio over the same
/// taps is that of two correlated normal samples (Pitman 1939, Morgan 1939).
/// @param same_taps  The series have the same taps in the same order: only taps that are good in
/// all are used.
[[nodiscard]] std::vector<SeriesScatter> Compare(std::span<const TapSeries> series, bool same_taps);

}  // namespace trammel::tap

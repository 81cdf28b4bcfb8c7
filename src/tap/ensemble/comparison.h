// Compares how well series of taps repeat: two methods on the same taps, or the taps of several
// files.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "tap/ensemble/ensemble.h"

namespace trammel::tap {

/// The taps of one row of the table, in the order of time.
struct TapSeries {
  std::string name;
  std::vector<TapResult> taps;
};

/// How the heights of a series repeat, about the mean of each place.
struct SeriesScatter {
  std::string name;
  std::size_t taps = 0;
  std::size_t good = 0;
  std::size_t used = 0;     ///< Good ones at a place that has two of them, outliers among them.
  double claimed_mm = 0;    ///< The taps' own standard uncertainties (rms); NaN without a tap.
  double mean_step_mm = 0;  ///< As Ensemble's: a slow drift is not in it.
  Measured deviation_mm;    ///< Standard deviation, pooled over the places.
  Measured ratio;           ///< deviation_mm divided by that of the first series.
};

/// Least degrees of freedom (taps less places): with fewer, the interval of a ratio spans more than
/// a factor of four.
inline constexpr double kLeastComparisonFreedom = 8;

/// Compares each series with the first.
///
/// Intervals of a deviation are those of normal heights (1 / sqrt(2 f) in its logarithm) or, where
/// wider, the jackknife's over taps, which heavy tails widen (Miller 1968). A ratio over the same
/// taps is that of two correlated normal samples (Pitman 1939, Morgan 1939).
/// @param same_taps  The series hold the same taps in the same order: only those that all have good
///                   are used.
[[nodiscard]] std::vector<SeriesScatter> Compare(std::span<const TapSeries> series, bool same_taps);

}  // namespace trammel::tap

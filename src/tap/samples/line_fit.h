// Medians and counts over a tap's samples.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace trammel::tap {

/// Stretch of samples [first, end).
struct Stretch {
  std::size_t first = 0;
  std::size_t end = 0;

  [[nodiscard]] std::size_t size() const { return end - first; }
};

/// Computes the median of up to kMax values spread evenly over a stretch; NaN if it is empty.
template <std::size_t kMax, class Value>
[[nodiscard]] double MedianOver(Stretch stretch, const Value& value) {
  if (stretch.end <= stretch.first) return std::numeric_limits<double>::quiet_NaN();
  const std::size_t length = stretch.end - stretch.first;
  const std::size_t count = std::min(length, kMax);
  std::array<float, kMax> picked;
  for (std::size_t i = 0; i < count; ++i) {
    picked[i] = static_cast<float>(value(stretch.first + (2 * i + 1) * length / (2 * count)));
  }
  const auto middle = picked.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(picked.begin(), middle, picked.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

/// Returns the median, or the upper of the middle two. Reorders the values. REQUIRES values.
[[nodiscard]] inline double UpperMedian(std::span<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Counts pairs of neighbours for which `holds` is true.
template <class Holds>
[[nodiscard]] std::size_t CountPairs(std::span<const float> values, const Holds& holds) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    count += holds(values[i - 1], values[i]) ? 1 : 0;
  }
  return count;
}

/// Sums a number over neighbours.
template <class Value>
[[nodiscard]] double SumPairs(std::span<const float> values, const Value& value) {
  double sum = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    sum += value(values[i - 1], values[i]);
  }
  return sum;
}

/// Returns the minimum distance of neighbours that differ; infinity if none do.
[[nodiscard]] inline float LeastChange(std::span<const float> values) {
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t i = 1; i < values.size(); ++i) {
    const float change = std::abs(values[i] - values[i - 1]);
    if (change > 0 && change < least) least = change;
  }
  return least;
}

/// Samples for the decomposition: times from the pull-back's start, forces from a level of the tap
/// itself, so that single precision resolves 1 us and 0.1 mgf. Half the memory of the recording,
/// and twice as many in a cache line.
struct Samples {
  std::span<const float> time_s;
  std::span<const float> force_g;

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
};

/// Returns the index of the first sample at or after a time, as rounded to single precision; size()
/// if there is none.
[[nodiscard]] std::size_t IndexAt(std::span<const float> time_s, double at_s);

/// Least-squares line, stored at its centroid: there level and slope are independent.
struct LineFit {
  double mean_time_s = 0;
  double mean_force_g = 0;
  double slope_g_s = 0;
  double time_spread_s2 = 0;  ///< Sum of squared distances from mean_time_s.
  double residual_g2 = 0;     ///< Sum of squared residuals.
  std::size_t count = 0;      ///< Samples; 0 where there is no line.

  [[nodiscard]] double Force(double time_s) const {
    return mean_force_g + slope_g_s * (time_s - mean_time_s);
  }
  /// Returns the standard deviation of a sample about the line, gf; 0 below three samples.
  [[nodiscard]] double Noise() const;
};

/// Fits a line to samples first … end - 1. Fewer than two distinct times yield a level without
/// slope.
[[nodiscard]] LineFit FitLine(const Samples& samples, std::size_t first, std::size_t end);

/// Splits samples first … end - 1 into two independent straight lines with the lowest summed
/// residual; every split is tried.
///
/// Sums use double: the residual is a difference of sums that are 10^4 times larger, which in
/// single precision (24 bits) would be rounding.
/// @param least  Minimum number of samples of either line, >= 2.
/// @returns the first sample of the right line, or `end` if there are fewer than 2 least.
/// Cost: O(end - first), no memory.
[[nodiscard]] std::size_t FindElbow(const Samples& samples, std::size_t first, std::size_t end,
                                    std::size_t least);

/// 97.5 % quantile of Student's t by its expansion in 1 / freedom (Fisher & Cornish 1960;
/// Abramowitz & Stegun 26.7.5), within 1 % from 3 on: the shared library has no other.
[[nodiscard]] double Student95(double freedom);

/// Crossing of two lines.
struct Crossing {
  double time_s = 0;
  double force_g = 0;
  /// Uncertainty of time_s, from the scatter about each line alone. It assumes straight lines and a
  /// known elbow between them: a press that curves moves the crossing by more.
  double standard_uncertainty_s = 0;
};

/// Computes the crossing. Parallel lines cross at infinity: time_s is then not finite.
[[nodiscard]] Crossing Intersect(const LineFit& left, const LineFit& right);

}  // namespace trammel::tap

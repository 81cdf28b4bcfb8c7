// Medians and counts over a tap's samples.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace trammel::tap {

/// Samples [first, end).
struct Stretch {
  std::size_t first = 0;
  std::size_t end = 0;

  [[nodiscard]] std::size_t size() const { return end - first; }
};

/// Median of up to kMost values spread evenly over a stretch; NaN where it is empty.
template <std::size_t kMost, class Value>
[[nodiscard]] double MedianOver(Stretch stretch, const Value& value) {
  if (stretch.end <= stretch.first) return std::numeric_limits<double>::quiet_NaN();
  const std::size_t length = stretch.end - stretch.first;
  const std::size_t count = std::min(length, kMost);
  std::array<float, kMost> picked;
  for (std::size_t i = 0; i < count; ++i) {
    picked[i] = static_cast<float>(value(stretch.first + (2 * i + 1) * length / (2 * count)));
  }
  const auto middle = picked.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(picked.begin(), middle, picked.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

/// The median, or the upper of the middle two. Leaves the values in another order. REQUIRES values.
[[nodiscard]] inline double UpperMedian(std::span<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Counts neighbours of which something holds.
template <class Holds>
[[nodiscard]] std::size_t CountPairs(std::span<const float> values, const Holds& holds) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    count += holds(values[i - 1], values[i]) ? 1 : 0;
  }
  return count;
}

/// Sums a number over neighbours, in runs side by side: one addition need not wait for the one
/// before it.
template <class Value>
[[nodiscard]] double SumPairs(std::span<const float> values, const Value& value) {
  constexpr std::size_t kRuns = 4;
  std::array<double, kRuns> sums{};
  const float* const at = values.data();
  std::size_t i = 1;
  for (; i + kRuns <= values.size(); i += kRuns) {
    for (std::size_t k = 0; k < kRuns; ++k) {
      sums[k] += value(at[i + k - 1], at[i + k]);
    }
  }
  for (; i < values.size(); ++i) {
    sums[0] += value(at[i - 1], at[i]);
  }
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

/// The least distance of neighbours that differ; infinity where none do.
[[nodiscard]] inline float LeastChange(std::span<const float> values) {
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t i = 1; i < values.size(); ++i) {
    const float change = std::abs(values[i] - values[i - 1]);
    if (change > 0 && change < least) least = change;
  }
  return least;
}

}  // namespace trammel::tap

// Medians and counts over a tap's samples, without branches: asked of every tap.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace trammel::tap {

/// Samples [first, end).
struct Stretch {
  std::size_t first = 0;
  std::size_t end = 0;
};

/// Median of up to kMost values spread evenly over a stretch; NaN where it is empty.
template <std::size_t kMost, class Value>
[[nodiscard]] double MedianOver(Stretch stretch, const Value& value) {
  if (stretch.end <= stretch.first) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  constexpr std::size_t kLanes = (kMost + 3) / 4 * 4;
  const auto length = static_cast<std::uint32_t>(stretch.end - stretch.first);
  const std::uint32_t count = std::min<std::uint32_t>(length, kMost);
  std::array<float, kLanes> picked;
  picked.fill(std::numeric_limits<float>::infinity());
  // At (2 i + 1) length / (2 count), the quotient carried on: a division costs as much as the rest.
  const std::uint32_t parts = 2 * count;
  const std::uint32_t step = 2 * length / parts;
  const std::uint32_t step_rest = 2 * length % parts;
  std::size_t at = stretch.first + length / parts;
  std::uint32_t rest = length % parts;
  for (std::size_t i = 0; i < count; ++i) {
    picked[i] = static_cast<float>(value(at));
    rest += step_rest;
    at += step + (rest >= parts ? 1 : 0);
    rest -= rest >= parts ? parts : 0;
  }
  // The median is the largest that no more than half of the others lie below: counted without
  // branches, where a partial sort would guess wrongly at every other one.
  std::array<std::int32_t, kLanes> below{};
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      below[i] += picked[k] < picked[i] ? 1 : 0;
    }
  }
  constexpr float kLowest = -std::numeric_limits<float>::infinity();
  std::array<float, kLanes> lower;
  for (std::size_t i = 0; i < kLanes; ++i) {
    lower[i] = below[i] <= static_cast<std::int32_t>(count / 2) ? picked[i] : kLowest;
  }
  float median = kLowest;
  for (const float value : lower) {
    median = std::max(median, value);
  }
  return median;
}

/// The value that so many others lie below, as std::nth_element finds it, but without branches:
/// on which side of a pivot a value lies nobody can predict. Leaves the values in another order.
/// @param rank  REQUIRES < values.size().
[[nodiscard]] inline double ValueOfRank(std::span<double> values, std::size_t rank) {
  constexpr int kMostRounds = 24;  // of unlucky pivots that somebody may have chosen
  for (int round = 0; round < kMostRounds; ++round) {
    const double first = values.front();
    const double middle = values[values.size() / 2];
    const double last = values.back();
    const double pivot = std::max(std::min(first, middle), std::min(std::max(first, middle), last));
    const auto to_front = [](std::span<double> all, const auto& holds) {
      std::size_t count = 0;
      for (double& value : all) {
        const double here = value;
        value = all[count];
        all[count] = here;
        count += holds(here) ? 1 : 0;
      }
      return count;
    };
    const std::size_t below = to_front(values, [pivot](double value) { return value < pivot; });
    if (rank < below) {
      values = values.first(below);
      continue;
    }
    values = values.subspan(below);
    rank -= below;
    const std::size_t equal = to_front(values, [pivot](double value) { return !(value > pivot); });
    if (rank < equal) {
      return pivot;
    }
    values = values.subspan(equal);
    rank -= equal;
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Counts neighbours of which something holds, without branches: several pairs in one instruction.
template <class Holds>
[[nodiscard]] std::size_t CountPairs(std::span<const float> values, const Holds& holds) {
  std::uint32_t count = 0;
  const float* const at = values.data();
  for (std::size_t i = 1; i < values.size(); ++i) {
    count += holds(at[i - 1], at[i]) ? 1 : 0;
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
  constexpr std::size_t kRuns = 8;
  constexpr float kNone = std::numeric_limits<float>::infinity();
  std::array<float, kRuns> least;
  least.fill(kNone);
  const auto take = [&](std::size_t i, std::size_t run) {
    const float change = std::abs(values[i] - values[i - 1]);
    const float counted = change > 0 ? change : kNone;
    least[run] = counted < least[run] ? counted : least[run];
  };
  std::size_t i = 1;
  for (; i + kRuns <= values.size(); i += kRuns) {
    for (std::size_t k = 0; k < kRuns; ++k) {
      take(i + k, k);
    }
  }
  for (; i < values.size(); ++i) {
    take(i, 0);
  }
  return *std::min_element(least.begin(), least.end());
}

}  // namespace trammel::tap

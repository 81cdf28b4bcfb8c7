// Running sums over samples, and what they become about another origin: what the sums of squares of
// every press are made of.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace trammel::tap {

/// Sums over the samples from the first one up to some place. Without values to begin with:
/// thousands of them are written anew for every tap.
struct Moments {
  std::array<double, 7> y;      ///< Of weight y^i,
  std::array<double, 4> force;  ///< and of weight force y^i.
};

/// Turns sums of y^j into sums of (at - y)^j over the same samples: differences of neighbours,
/// power by power, which is (at - y)^(i+1) y^j = at (at - y)^i y^j - (at - y)^i y^(j+1).
template <std::size_t kCount, std::size_t kAll>
[[nodiscard]] std::array<double, kCount> Shifted(const std::array<double, kAll>& moments,
                                                 double at) {
  static_assert(kCount <= kAll);
  std::array<double, kCount> d;
  std::copy_n(moments.begin(), kCount, d.begin());
  for (std::size_t i = 1; i < kCount; ++i) {
    for (std::size_t j = kCount - 1; j >= i; --j) {
      d[j] = at * d[j - 1] - d[j];
    }
  }
  return d;
}

/// A pivot below this share of its column is rounding: the column adds nothing.
inline constexpr double kLeastPivot = 1e-11;

[[nodiscard]] inline double Invert(double pivot, double column) {
  return pivot > kLeastPivot * column ? 1 / pivot : 0;
}

}  // namespace trammel::tap

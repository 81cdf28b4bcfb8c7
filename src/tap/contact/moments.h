// Running sums over samples, and their conversion to another origin, for the sums of squares of
// every press.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace trammel::tap {

/// Sums over the samples from the first up to a given one. Without initial values: every tap
/// rewrites thousands of them.
struct Moments {
  std::array<double, 7> y;      ///< weighted by y^i,
  std::array<double, 4> force;  ///< and of weight force y^i.
};

/// Converts sums of y^j to sums of (at - y)^j over the same samples: differences of neighbours,
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

/// Minimum pivot as a share of its column; a smaller one is rounding, and the column adds nothing.
inline constexpr double kMinPivot = 1e-11;

[[nodiscard]] inline double Invert(double pivot, double column) {
  return pivot > kMinPivot * column ? 1 / pivot : 0;
}

}  // namespace trammel::tap

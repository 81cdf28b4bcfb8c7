// Running sums over samples, and what they become about another origin: what the sums of squares of
// every press are made of.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace trammel::tap {

/// Two numbers that are worked on at once.
using Pair = double __attribute__((vector_size(16)));

/// Sums over the samples from the first one up to some place. Without values to begin with:
/// thousands of them are written anew for every tap.
struct Moments {
  std::array<double, 7> y;      ///< Of weight y^i,
  std::array<double, 4> force;  ///< and of weight force y^i.
};

/// Turns sums of y^j into sums of (at - y)^j over the same samples: differences of neighbours,
/// power by power, which is (at - y)^(i+1) y^j = at (at - y)^i y^j - (at - y)^i y^(j+1).
template <class Real, std::size_t kCount>
void Shift(std::array<Real, kCount>& d, const Real& at) {
#pragma GCC unroll 8
  for (std::size_t i = 1; i < kCount; ++i) {
#pragma GCC unroll 8
    for (std::size_t j = kCount - 1; j >= i; --j) {
      d[j] = at * d[j - 1] - d[j];
    }
  }
}

template <std::size_t kCount, std::size_t kAll>
[[nodiscard]] std::array<double, kCount> Shifted(const std::array<double, kAll>& moments,
                                                 double at) {
  static_assert(kCount <= kAll);
  std::array<double, kCount> d;
  std::copy_n(moments.begin(), kCount, d.begin());
  Shift(d, at);
  return d;
}

/// Of two places side by side.
template <std::size_t kCount, std::size_t kAll>
[[nodiscard]] std::array<Pair, kCount> Shifted(const std::array<double, kAll>& first,
                                               const std::array<double, kAll>& second,
                                               const Pair& at) {
  static_assert(kCount <= kAll);
  std::array<Pair, kCount> d;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < kCount; ++i) {
    d[i] = Pair{first[i], second[i]};
  }
  Shift(d, at);
  return d;
}

/// A pivot below this share of its column is rounding: the column adds nothing.
inline constexpr double kLeastPivot = 1e-11;

[[nodiscard]] inline double Invert(double pivot, double column) {
  return pivot > kLeastPivot * column ? 1 / pivot : 0;
}

[[nodiscard]] inline Pair Invert(const Pair& pivot, const Pair& column) {
  return pivot > kLeastPivot * column ? 1 / pivot : Pair{0, 0};
}

}  // namespace trammel::tap

// Normal equations of a few parameters, without the heap: one for each disc and edge in a picture,
// or some side by side.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "part_alignment/targets/four.h"

namespace trammel::part_alignment {

/// @tparam Number  a double, or FourDoubles of four vectors.
template <std::size_t kSize, typename Number = double>
using SmallVector = std::array<Number, kSize>;
/// Rows; the lower triangle counts.
template <std::size_t kSize, typename Number = double>
using SmallMatrix = std::array<SmallVector<kSize, Number>, kSize>;

/// In place: Cholesky's factor in the lower triangle. False where it is not positive definite; what
/// it leaves is then of no use.
template <std::size_t kSize, typename Number>
[[nodiscard, gnu::always_inline]] inline Mask<Number> Factor(
    std::array<std::array<Number, kSize>, kSize>& a) {
  constexpr double kSingular = 1e-12;  // of a pivot, to what it was
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  Mask<Number> is_definite = Number{} == Number{};
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      Number sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      if (i == j) {
        is_definite &= (sum > kSingular * a[i][i]) & (sum < kInfinite);
        if (!Any(is_definite)) return is_definite;
        a[i][i] = Root(sum);
      } else {
        a[i][j] = sum / a[j][j];
      }
    }
  }
  return is_definite;
}

/// @param factor  as Factor leaves it
template <std::size_t kSize, typename Number>
[[nodiscard, gnu::always_inline]] inline SmallVector<kSize, Number> SolveFactored(
    const std::array<std::array<Number, kSize>, kSize>& factor, std::array<Number, kSize> b) {
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= factor[i][k] * b[k];
    b[i] /= factor[i][i];
  }
  for (std::size_t i = kSize; i-- > 0;) {
    for (std::size_t k = i + 1; k < kSize; ++k) b[i] -= factor[k][i] * b[k];
    b[i] /= factor[i][i];
  }
  return b;
}

}  // namespace trammel::part_alignment

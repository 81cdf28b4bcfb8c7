// Normal equations of a few parameters, without the heap: one for each disc and edge in a picture.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace trammel::part_alignment {

template <std::size_t kSize>
using SmallVector = std::array<double, kSize>;
template <std::size_t kSize>
using SmallMatrix = std::array<SmallVector<kSize>, kSize>;  ///< rows; the lower triangle counts

/// In place: Cholesky's factor in the lower triangle. False where it is not positive definite.
template <std::size_t kSize>
[[nodiscard]] bool Factor(SmallMatrix<kSize>& a) {
  constexpr double kSingular = 1e-12;  // of a pivot, to what it was
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      if (i == j) {
        if (!(sum > kSingular * a[i][i]) || !std::isfinite(sum)) return false;
        a[i][i] = std::sqrt(sum);
      } else {
        a[i][j] = sum / a[j][j];
      }
    }
  }
  return true;
}

/// @param factor  as Factor leaves it
template <std::size_t kSize>
[[nodiscard]] SmallVector<kSize> SolveFactored(const SmallMatrix<kSize>& factor,
                                               SmallVector<kSize> b) {
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

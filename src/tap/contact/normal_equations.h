// Normal equations of five unknowns, the measured value as the last column.
#pragma once

#include <array>
#include <cstddef>

namespace trammel::tap {

inline constexpr std::size_t kNormalUnknowns = 5;
using NormalRow = std::array<double, kNormalUnknowns + 1>;
/// The upper triangle of sums of products.
using Normal = std::array<NormalRow, kNormalUnknowns + 1>;

/// Adds an equation.
inline void AddRow(const NormalRow& row, double weight, Normal& m) {
  for (std::size_t a = 0; a <= kNormalUnknowns; ++a) {
    for (std::size_t b = a; b <= kNormalUnknowns; ++b) {
      m[a][b] += weight * row[a] * row[b];
    }
  }
}

/// Eliminates in place: rows end up divided by their pivots, which stay on the diagonal. Returns
/// false where a pivot is not positive.
[[nodiscard]] inline bool Eliminate(Normal& m) {
  for (std::size_t k = 0; k < kNormalUnknowns; ++k) {
    if (!(m[k][k] > 0)) {
      return false;
    }
    for (std::size_t i = k + 1; i <= kNormalUnknowns; ++i) {
      const double factor = m[k][i] / m[k][k];
      for (std::size_t j = i; j <= kNormalUnknowns; ++j) {
        m[i][j] -= factor * m[k][j];
      }
    }
    for (std::size_t j = k + 1; j <= kNormalUnknowns; ++j) {
      m[k][j] /= m[k][k];
    }
  }
  return true;
}

}  // namespace trammel::tap

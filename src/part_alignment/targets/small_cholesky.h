// Normal equations of a few parameters, without the heap: one for each disc in a picture.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <optional>

namespace trammel::part_alignment {

template <int kSize>
using SmallMatrix = Eigen::Matrix<double, kSize, kSize>;
template <int kSize>
using SmallVector = Eigen::Matrix<double, kSize, 1>;

/// Factors a matrix, of which the lower triangle counts. Absent where it is not positive definite.
template <int kSize>
[[nodiscard]] std::optional<Eigen::LLT<SmallMatrix<kSize>>> Factored(
    const SmallMatrix<kSize>& matrix) {
  constexpr double kSingular = 1e-12;  // of a pivot, to what it was
  if (!matrix.template triangularView<Eigen::Lower>().toDenseMatrix().allFinite()) {
    return std::nullopt;
  }
  std::optional<Eigen::LLT<SmallMatrix<kSize>>> factor(matrix);
  if (factor->info() != Eigen::Success) return std::nullopt;
  const auto pivots = factor->matrixLLT().diagonal().array().square();
  if (!(pivots > kSingular * matrix.diagonal().array()).all()) return std::nullopt;
  return factor;
}

}  // namespace trammel::part_alignment

// Eigen's costly decompositions behind plain functions: as templates they cost the compiler ten to
// thirty seconds in every file. For matrices of up to some hundred rows.
#pragma once

#include <Eigen/Core>

namespace trammel::geometry {

/// matrix = u · diag(values) · vᵀ, with k = min(rows, columns).
struct SingularValues {
  Eigen::MatrixXd u;       ///< rows × k
  Eigen::VectorXd values;  ///< k, from the largest down
  Eigen::MatrixXd v;       ///< columns × k
};

/// By Jacobi's rotations. REQUIRES finite entries.
[[nodiscard]] SingularValues DecomposeSingular(const Eigen::MatrixXd& matrix);

struct SymmetricEigen {
  Eigen::VectorXd values;   ///< from the smallest up
  Eigen::MatrixXd vectors;  ///< columns in their order, of length 1
};

/// REQUIRES a square matrix; reads its lower triangle.
[[nodiscard]] SymmetricEigen DecomposeSymmetric(const Eigen::MatrixXd& matrix);

/// Its values alone, at less than half the work.
[[nodiscard]] Eigen::VectorXd SymmetricEigenvalues(const Eigen::MatrixXd& matrix);

/// A matrix that gives the covariance, times its own transpose: it makes independent draws of unit
/// variance the covariance's. Whatever the units of its rows; what is below 0 in it by chance is
/// left out. REQUIRES a square matrix.
[[nodiscard]] Eigen::MatrixXd CovarianceRoot(const Eigen::MatrixXd& covariance);

}  // namespace trammel::geometry

// Eigen's costly decompositions behind plain functions: as templates they cost the compiler ten to
// thirty seconds in every file. For matrices of up to some hundred rows. Systems: linear_systems.h.
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

/// matrix · vectors = vectors · diag(values) for any square matrix, in no order; complex pairs are
/// conjugate.
struct GeneralEigen {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;  ///< columns of length 1
};

/// REQUIRES a square matrix with finite entries.
[[nodiscard]] GeneralEigen DecomposeGeneral(const Eigen::MatrixXd& matrix);

/// An orthogonal matrix of which the last columns are orthogonal to all columns of the given one
/// (its Q in QR, all of it). REQUIRES independent columns, no more than rows.
[[nodiscard]] Eigen::MatrixXd OrthogonalCompletion(const Eigen::MatrixXd& columns);

/// matrix = q · r by Householder's reflections.
struct OrthogonalTriangular {
  Eigen::MatrixXd q;  ///< rows × columns, orthonormal
  Eigen::MatrixXd r;  ///< columns × columns, upper triangle
};

/// REQUIRES no more columns than rows.
[[nodiscard]] OrthogonalTriangular DecomposeOrthogonal(const Eigen::MatrixXd& matrix);

/// matrix, its columns in another order, = q · r by Householder's reflections, with k = min(rows,
/// columns): the columns that are most independent come first.
struct PivotedOrthogonal {
  Eigen::MatrixXd q;      ///< rows × k, orthonormal
  Eigen::MatrixXd r;      ///< k × columns, upper triangle, its diagonal falling in size
  Eigen::VectorXi order;  ///< the matrix's column behind each column of r
};

[[nodiscard]] PivotedOrthogonal DecomposePivoted(const Eigen::MatrixXd& matrix);

/// A matrix that gives the covariance, times its own transpose: it makes independent draws of unit
/// variance the covariance's. Whatever the units of its rows; what is below 0 in it by chance is
/// left out. REQUIRES a square matrix.
[[nodiscard]] Eigen::MatrixXd CovarianceRoot(const Eigen::MatrixXd& covariance);

}  // namespace trammel::geometry

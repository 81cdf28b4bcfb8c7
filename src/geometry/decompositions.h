// Wraps Eigen's costly decompositions in plain functions: as templates they cost the compiler ten
// to thirty seconds in every file. For matrices of up to some hundred rows. Systems:
// linear_systems.h.
#pragma once

#include <Eigen/Core>

namespace trammel::geometry {

/// matrix = u · diag(values) · vᵀ, with k = min(rows, columns).
struct SingularValues {
  Eigen::MatrixXd u;       ///< rows × k
  Eigen::VectorXd values;  ///< k, from the largest down
  Eigen::MatrixXd v;       ///< columns × k
};

/// Decomposes by Jacobi's rotations. REQUIRES finite entries.
[[nodiscard]] SingularValues DecomposeSingular(const Eigen::MatrixXd& matrix);

struct SymmetricEigen {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< columns in their order, of length 1
};

/// REQUIRES a square matrix; reads its lower triangle.
[[nodiscard]] SymmetricEigen DecomposeSymmetric(const Eigen::MatrixXd& matrix);

/// Computes only the eigenvalues, in less than half the time.
[[nodiscard]] Eigen::VectorXd SymmetricEigenvalues(const Eigen::MatrixXd& matrix);

/// matrix · vectors = vectors · diag(values) for any square matrix, in no order; complex pairs are
/// conjugate.
struct GeneralEigen {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;  ///< columns of length 1
};

/// REQUIRES a square matrix with finite entries.
[[nodiscard]] GeneralEigen DecomposeGeneral(const Eigen::MatrixXd& matrix);

/// Returns an orthogonal matrix whose last columns are orthogonal to all given columns (the
/// complete Q of QR). REQUIRES independent columns, no more than rows.
[[nodiscard]] Eigen::MatrixXd OrthogonalCompletion(const Eigen::MatrixXd& columns);

/// matrix = q · r by Householder reflections.
struct OrthogonalTriangular {
  Eigen::MatrixXd q;  ///< rows × columns, orthonormal
  Eigen::MatrixXd r;  ///< columns × columns, upper triangle
};

/// REQUIRES no more columns than rows.
[[nodiscard]] OrthogonalTriangular DecomposeOrthogonal(const Eigen::MatrixXd& matrix);

/// matrix, with permuted columns, = q · r by Householder reflections, with k = min(rows, columns):
/// the most independent columns first.
struct PivotedOrthogonal {
  Eigen::MatrixXd q;      ///< rows × k, orthonormal
  Eigen::MatrixXd r;      ///< k × columns, upper triangle, its diagonal falling in size
  Eigen::VectorXi order;  ///< the matrix's column behind each column of r
};

[[nodiscard]] PivotedOrthogonal DecomposePivoted(const Eigen::MatrixXd& matrix);

/// Returns a root of the covariance: its product with its own transpose. It maps independent draws
/// of unit variance to draws of that covariance. Independent of the rows' units; negative
/// eigenvalues by chance count as 0. REQUIRES a square matrix.
[[nodiscard]] Eigen::MatrixXd CovarianceRoot(const Eigen::MatrixXd& covariance);

}  // namespace trammel::geometry

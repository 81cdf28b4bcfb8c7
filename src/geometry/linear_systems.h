// Wraps Eigen's solutions of linear systems in plain functions: as templates they cost the compiler
// seconds in every file. For matrices of up to some hundred rows.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace trammel::geometry {

/// Solves matrix · x = right by pivoted LDLᵀ, column by column. REQUIRES a symmetric semi-definite
/// matrix; reads its lower triangle.
[[nodiscard]] Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& matrix,
                                             const Eigen::MatrixXd& right);

/// Matrices for up to 16 unknowns, without the heap.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 16, 16>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 16, 1>;

/// Solves like SolveSymmetric, for one column.
[[nodiscard]] SmallVector SolveSmallSymmetric(const SmallMatrix& matrix, const SmallVector& right);

/// Returns jacobian · covariance · jacobianᵀ: the covariance of a function with this Jacobian.
/// REQUIRES as many columns as the covariance has rows.
[[nodiscard]] Eigen::MatrixXd PropagateCovariance(
    const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
    const Eigen::Ref<const Eigen::MatrixXd>& covariance);

/// Returns errorᵀ · covariance⁻¹ · error: chi-square distributed if the covariance is the error's.
/// REQUIRES a regular covariance.
[[nodiscard]] double SquaredMahalanobisDistance(const Eigen::MatrixXd& covariance,
                                                const Eigen::VectorXd& error);

/// Solves matrix · x = right by LU with complete pivoting. REQUIRES a square matrix.
[[nodiscard]] Eigen::MatrixXd SolveSquare(const Eigen::MatrixXd& matrix,
                                          const Eigen::MatrixXd& right);

/// Returns the shortest least-squares solution of matrix · x = right, for any shape and rank, by a
/// complete orthogonal decomposition.
[[nodiscard]] Eigen::MatrixXd SolveLeastSquares(const Eigen::MatrixXd& matrix,
                                                const Eigen::MatrixXd& right);

/// Solves like SolveLeastSquares; nothing if the columns are dependent (rank by pivoted Householder
/// reflections) or the solution is not finite.
[[nodiscard]] std::optional<Eigen::VectorXd> SolveOfFullRank(const Eigen::MatrixXd& matrix,
                                                             const Eigen::VectorXd& right);

/// Inverts like SolveSquare. REQUIRES a square, regular matrix.
[[nodiscard]] Eigen::MatrixXd Inverse(const Eigen::MatrixXd& matrix);

/// Solves matrix · x = right by Cholesky's decomposition; absent if the square of a pivot is not
/// above `least`: the matrix is not positive definite. REQUIRES a symmetric matrix; reads its lower
/// triangle.
[[nodiscard]] std::optional<Eigen::MatrixXd> SolvePositive(const Eigen::MatrixXd& matrix,
                                                           const Eigen::MatrixXd& right,
                                                           double least = 0);

/// Returns the lower triangle L with L · Lᵀ = matrix. REQUIRES a symmetric positive definite
/// matrix.
[[nodiscard]] Eigen::MatrixXd CholeskyRoot(const Eigen::MatrixXd& matrix);

/// Solves lower · x = right. REQUIRES a regular lower triangle; entries above it are not read.
[[nodiscard]] Eigen::MatrixXd SolveLower(const Eigen::MatrixXd& lower,
                                         const Eigen::MatrixXd& right);

/// Solves upper · x = right. REQUIRES a regular upper triangle; entries below it are not read.
[[nodiscard]] Eigen::MatrixXd SolveUpper(const Eigen::MatrixXd& upper,
                                         const Eigen::MatrixXd& right);

}  // namespace trammel::geometry

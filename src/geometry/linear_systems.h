// Eigen's solutions of linear systems behind plain functions: as templates they cost the compiler
// seconds in every file. For matrices of up to some hundred rows.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace trammel::geometry {

/// x of matrix · x = right by pivoted LDLᵀ, one column each. REQUIRES a symmetric semi-definite
/// matrix, whose lower triangle is read.
[[nodiscard]] Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& matrix,
                                             const Eigen::MatrixXd& right);

/// Up to 16 unknowns, without the heap.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 16, 16>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 16, 1>;

/// As SolveSymmetric, for one column.
[[nodiscard]] SmallVector SolveSmallSymmetric(const SmallMatrix& matrix, const SmallVector& right);

/// jacobian · covariance · jacobianᵀ: the covariance of what moves by `jacobian` with quantities
/// of that covariance. REQUIRES as many columns as the covariance has rows.
[[nodiscard]] Eigen::MatrixXd PropagateCovariance(
    const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
    const Eigen::Ref<const Eigen::MatrixXd>& covariance);

/// errorᵀ · covariance⁻¹ · error: chi-square distributed where the covariance is the error's.
/// REQUIRES a regular covariance.
[[nodiscard]] double SquaredMahalanobisDistance(const Eigen::MatrixXd& covariance,
                                                const Eigen::VectorXd& error);

/// x of matrix · x = right by LU with complete pivoting. REQUIRES a square matrix.
[[nodiscard]] Eigen::MatrixXd SolveSquare(const Eigen::MatrixXd& matrix,
                                          const Eigen::MatrixXd& right);

/// The shortest x of those that bring matrix · x nearest to right, of any shape and rank, by a
/// complete orthogonal decomposition.
[[nodiscard]] Eigen::MatrixXd SolveLeastSquares(const Eigen::MatrixXd& matrix,
                                                const Eigen::MatrixXd& right);

/// As SolveLeastSquares where the columns are independent (their rank by pivoted Householder
/// reflections) and the solution is finite; nothing otherwise.
[[nodiscard]] std::optional<Eigen::VectorXd> SolveOfFullRank(const Eigen::MatrixXd& matrix,
                                                             const Eigen::VectorXd& right);

/// As SolveSquare. REQUIRES a square, regular matrix.
[[nodiscard]] Eigen::MatrixXd Inverse(const Eigen::MatrixXd& matrix);

/// x of matrix · x = right by Cholesky's decomposition; nothing where the square of one of its
/// pivots is not above `least`, so that the matrix is not positive definite. REQUIRES a symmetric
/// matrix, whose lower triangle is read.
[[nodiscard]] std::optional<Eigen::MatrixXd> SolvePositive(const Eigen::MatrixXd& matrix,
                                                           const Eigen::MatrixXd& right,
                                                           double least = 0);

/// The lower triangle L with L · Lᵀ = matrix. REQUIRES a symmetric positive definite matrix.
[[nodiscard]] Eigen::MatrixXd CholeskyRoot(const Eigen::MatrixXd& matrix);

/// x of lower · x = right. REQUIRES a regular lower triangle; what is above it is not read.
[[nodiscard]] Eigen::MatrixXd SolveLower(const Eigen::MatrixXd& lower,
                                         const Eigen::MatrixXd& right);

/// x of upper · x = right. REQUIRES a regular upper triangle; what is below it is not read.
[[nodiscard]] Eigen::MatrixXd SolveUpper(const Eigen::MatrixXd& upper,
                                         const Eigen::MatrixXd& right);

}  // namespace trammel::geometry

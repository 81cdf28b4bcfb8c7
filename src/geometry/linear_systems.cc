#include "geometry/linear_systems.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

namespace trammel::geometry {

Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return matrix.ldlt().solve(right);
}

SmallVector SolveSmallSymmetric(const SmallMatrix& matrix, const SmallVector& right) {
  return matrix.ldlt().solve(right);
}

Eigen::MatrixXd PropagateCovariance(const Eigen::Ref<const Eigen::MatrixXd>& jacobian,
                                    const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  const Eigen::MatrixXd by_quantity = jacobian * covariance;
  return by_quantity * jacobian.transpose();
}

double SquaredMahalanobisDistance(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& error) {
  const Eigen::VectorXd solved = SolveSymmetric(covariance, error);
  return error.dot(solved);
}

Eigen::MatrixXd SolveSquare(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return matrix.fullPivLu().solve(right);
}

Eigen::MatrixXd SolveLeastSquares(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

std::optional<Eigen::VectorXd> SolveOfFullRank(const Eigen::MatrixXd& matrix,
                                               const Eigen::VectorXd& right) {
  const auto decomposition = matrix.colPivHouseholderQr();
  if (decomposition.rank() < matrix.cols()) return std::nullopt;
  const Eigen::VectorXd solution = decomposition.solve(right);
  if (!solution.allFinite()) return std::nullopt;
  return solution;
}

Eigen::MatrixXd Inverse(const Eigen::MatrixXd& matrix) {
  return SolveSquare(matrix, Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

std::optional<Eigen::MatrixXd> SolvePositive(const Eigen::MatrixXd& matrix,
                                             const Eigen::MatrixXd& right, double least) {
  const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
  if (factor.info() != Eigen::Success ||
      !(factor.matrixLLT().diagonal().cwiseAbs2().minCoeff() > least)) {
    return std::nullopt;
  }
  return factor.solve(right);
}

Eigen::MatrixXd CholeskyRoot(const Eigen::MatrixXd& matrix) { return matrix.llt().matrixL(); }

Eigen::MatrixXd SolveLower(const Eigen::MatrixXd& lower, const Eigen::MatrixXd& right) {
  return lower.triangularView<Eigen::Lower>().solve(right);
}

Eigen::MatrixXd SolveUpper(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& right) {
  return upper.triangularView<Eigen::Upper>().solve(right);
}

}  // namespace trammel::geometry

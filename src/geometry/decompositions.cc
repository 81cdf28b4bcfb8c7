#include "geometry/decompositions.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace trammel::geometry {

SingularValues DecomposeSingular(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

SymmetricEigen DecomposeSymmetric(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd SymmetricEigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

GeneralEigen DecomposeGeneral(const Eigen::MatrixXd& matrix) {
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return matrix.ldlt().solve(right);
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

Eigen::MatrixXd Inverse(const Eigen::MatrixXd& matrix) {
  return SolveSquare(matrix, Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

Eigen::MatrixXd CholeskyRoot(const Eigen::MatrixXd& matrix) { return matrix.llt().matrixL(); }

Eigen::MatrixXd SolveLower(const Eigen::MatrixXd& lower, const Eigen::MatrixXd& right) {
  return lower.triangularView<Eigen::Lower>().solve(right);
}

Eigen::MatrixXd SolveUpper(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& right) {
  return upper.triangularView<Eigen::Upper>().solve(right);
}

Eigen::MatrixXd OrthogonalCompletion(const Eigen::MatrixXd& columns) {
  return columns.householderQr().householderQ();
}

Eigen::MatrixXd CovarianceRoot(const Eigen::MatrixXd& covariance) {
  // Of the correlations: rows of very different sizes would drown each other.
  const Eigen::VectorXd sigmas = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd scale = (sigmas.array() > 0).select(sigmas, 1);
  const Eigen::VectorXd unscale = scale.cwiseInverse();
  const SymmetricEigen of =
      DecomposeSymmetric(unscale.asDiagonal() * covariance * unscale.asDiagonal());
  return scale.asDiagonal() * of.vectors * of.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

}  // namespace trammel::geometry

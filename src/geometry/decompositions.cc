#include "geometry/decompositions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>

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

Eigen::MatrixXd OrthogonalCompletion(const Eigen::MatrixXd& columns) {
  return columns.householderQr().householderQ();
}

OrthogonalTriangular DecomposeOrthogonal(const Eigen::MatrixXd& matrix) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(matrix);
  return {.q = qr.householderQ() * Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()),
          .r = qr.matrixQR().topRows(matrix.cols()).triangularView<Eigen::Upper>()};
}

PivotedOrthogonal DecomposePivoted(const Eigen::MatrixXd& matrix) {
  const Eigen::Index k = std::min(matrix.rows(), matrix.cols());
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(matrix);
  return {.q = qr.householderQ() * Eigen::MatrixXd::Identity(matrix.rows(), k),
          .r = qr.matrixQR().topRows(k).triangularView<Eigen::Upper>(),
          .order = qr.colsPermutation().indices()};
}

Eigen::MatrixXd CovarianceRoot(const Eigen::MatrixXd& covariance) {
  // Decomposes the correlations: rows of very different magnitudes would lose precision.
  const Eigen::VectorXd sigmas = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd scale = (sigmas.array() > 0).select(sigmas, 1);
  const Eigen::VectorXd unscale = scale.cwiseInverse();
  const SymmetricEigen of =
      DecomposeSymmetric(unscale.asDiagonal() * covariance * unscale.asDiagonal());
  return scale.asDiagonal() * of.vectors * of.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

}  // namespace trammel::geometry

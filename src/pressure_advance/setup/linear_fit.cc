#include "pressure_advance/setup/linear_fit.h"

#include <algorithm>
#include <cmath>

#include "base/square.h"
#include "base/statistics.h"
#include "geometry/linear_systems.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kLeastLeftOver = 3;
constexpr double kGreatestInverse = 1e10;  // of the normalised normal matrix: condition squared

}  // namespace

std::optional<LinearFit> FitLinear(const Eigen::MatrixXd& design, const Eigen::VectorXd& observed) {
  const Eigen::Index columns = design.cols();
  LinearFit fit;
  fit.degrees_of_freedom = static_cast<double>(design.rows() - columns);
  if (fit.degrees_of_freedom < kLeastLeftOver) return std::nullopt;
  Eigen::VectorXd length(columns);
  for (Eigen::Index i = 0; i < columns; ++i) length[i] = design.col(i).norm();
  if (!length.allFinite() || !observed.allFinite() || length.minCoeff() <= 0) return std::nullopt;
  Eigen::MatrixXd unit = design;
  for (Eigen::Index i = 0; i < columns; ++i) unit.col(i) /= length[i];
  const Eigen::MatrixXd normal = unit.transpose() * unit;
  Eigen::MatrixXd inverse =
      geometry::SolveSymmetric(normal, Eigen::MatrixXd::Identity(columns, columns));
  const Eigen::MatrixXd check = normal * inverse - Eigen::MatrixXd::Identity(columns, columns);
  constexpr double kInverted = 1e-3;  // a singular matrix is not inverted, whatever comes back
  if (!inverse.allFinite() || inverse.diagonal().minCoeff() <= 0 ||
      inverse.diagonal().maxCoeff() > kGreatestInverse || check.cwiseAbs().maxCoeff() > kInverted) {
    return std::nullopt;
  }
  const Eigen::VectorXd scaled = inverse * (unit.transpose() * observed);
  const Eigen::VectorXd left = observed - unit * scaled;
  const double variance = left.squaredNorm() / fit.degrees_of_freedom;
  fit.residual = std::sqrt(variance);
  const Eigen::VectorXd back = length.cwiseInverse();
  fit.value = scaled.cwiseProduct(back);
  fit.covariance = variance * (back.asDiagonal() * inverse * back.asDiagonal());
  return fit;
}

double Variance(const LinearFit& fit, const Eigen::VectorXd& gradient) {
  return std::max(0.0, gradient.dot(fit.covariance * gradient));
}

Measured MeasuredFrom(double value, double statistical, double systematic,
                      double degrees_of_freedom) {
  const double u = std::sqrt(statistical + systematic);
  const double half = std::sqrt(Square(StudentT95(degrees_of_freedom)) * statistical +
                                Square(kNormal95) * systematic);
  return Measured::Good({value, u, {value - half, value + half}});
}

}  // namespace trammel::pressure_advance

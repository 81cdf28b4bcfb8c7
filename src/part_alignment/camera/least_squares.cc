#include "part_alignment/camera/least_squares.h"

#include <cmath>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

constexpr double kEnoughStep = 1e-10;
constexpr double kStuckDamping = 1e14;

Eigen::VectorXd ColumnLengths(const Eigen::MatrixXd& jacobian) {
  Eigen::VectorXd lengths = jacobian.colwise().norm().transpose();
  for (double& length : lengths) {
    if (!(length > 0)) length = 1;
  }
  return lengths;
}

}  // namespace

LeastSquaresFit FitLeastSquares(const ResidualFunction& function, Eigen::VectorXd start,
                                int most_iterations) {
  LeastSquaresFit fit;
  fit.x = std::move(start);
  if (!function(fit.x, fit.residuals, &fit.jacobian)) return fit;
  double cost = fit.residuals.squaredNorm();
  double damping = 1e-4;
  Eigen::VectorXd trial_residuals;
  while (fit.iterations < most_iterations && std::isfinite(cost)) {
    ++fit.iterations;
    const Eigen::VectorXd scale = ColumnLengths(fit.jacobian);
    const Eigen::MatrixXd scaled = fit.jacobian * scale.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd normal = scaled.transpose() * scaled;
    const Eigen::VectorXd gradient = scaled.transpose() * fit.residuals;
    bool accepted = false;
    double length = 0;
    while (!accepted && damping < kStuckDamping) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal().array() += damping;
      const Eigen::VectorXd step = -geometry::SolveSymmetric(damped, gradient);
      length = step.norm();
      const Eigen::VectorXd trial = fit.x + step.cwiseQuotient(scale);
      const bool there = function(trial, trial_residuals, nullptr);
      const double trial_cost = there ? trial_residuals.squaredNorm() : INFINITY;
      // A step below the end's threshold is taken whatever rounding makes of the cost.
      accepted = trial_cost <= cost || (there && length < kEnoughStep);
      if (accepted) {
        fit.x = trial;
        cost = trial_cost;
        damping = std::max(damping * 0.1, 1e-15);
      } else {
        damping = std::max(damping, 1e-12) * 10;
        if (length < kEnoughStep) break;
      }
    }
    if (accepted) function(fit.x, fit.residuals, &fit.jacobian);
    if (!accepted || length < kEnoughStep) {
      // Without a better step anywhere this is the least that rounding lets one find.
      fit.converged = std::isfinite(cost);
      break;
    }
  }
  return fit;
}

ScaledInverse InvertNormal(const Eigen::MatrixXd& jacobian) {
  const Eigen::VectorXd scale = ColumnLengths(jacobian);
  const Eigen::MatrixXd scaled = jacobian * scale.cwiseInverse().asDiagonal();
  const geometry::SingularValues of = geometry::DecomposeSingular(scaled);
  const Eigen::VectorXd& singular = of.values;
  const Eigen::Index last = singular.size() - 1;
  ScaledInverse inverse;
  inverse.weakest = of.v.col(last);
  constexpr double kZero = 1e-150;  // its inverse square is still a number
  const Eigen::VectorXd inverse_singular = singular.cwiseMax(kZero).cwiseInverse();
  const Eigen::MatrixXd root =
      scale.cwiseInverse().asDiagonal() * of.v * inverse_singular.asDiagonal();
  inverse.covariance = root * root.transpose();
  return inverse;
}

}  // namespace trammel::part_alignment

#include "part_alignment/network/least_squares.h"

#include <cmath>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/network/descent.h"
#include "part_alignment/network/normal.h"

namespace trammel::part_alignment {
namespace {

Eigen::VectorXd ColumnLengths(const Eigen::MatrixXd& jacobian) {
  Eigen::VectorXd lengths = jacobian.colwise().norm().transpose();
  for (double& length : lengths) {
    if (!(length > 0)) length = 1;
  }
  return lengths;
}

struct ResidualModel {
  const ResidualFunction& function;
  [[nodiscard]] double Cost(const Eigen::VectorXd& x) const {
    Eigen::VectorXd residuals;
    return function(x, residuals, nullptr) ? residuals.squaredNorm()
                                           : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] NormalEquations Linearise(const Eigen::VectorXd& x) const {
    Eigen::VectorXd residuals;
    Eigen::MatrixXd jacobian;
    (void)function(x, residuals, &jacobian);
    return {jacobian.transpose() * jacobian, -(jacobian.transpose() * residuals), {}};
  }
  [[nodiscard]] Proposal<Eigen::VectorXd> Propose(const NormalEquations& normal, double damping,
                                                  const Eigen::VectorXd& x) const {
    const NormalStep step = Solve(normal, {}, damping);
    return {x + step.shared, step.decrement};
  }
};

}  // namespace

LeastSquaresFit FitLeastSquares(const ResidualFunction& function, Eigen::VectorXd start) {
  constexpr double kEnough = 1e-20;  // 1e-10 of the residuals' unit, squared
  LeastSquaresFit fit;
  fit.x = std::move(start);
  const DescentEnd end =
      Minimise(ResidualModel{function}, {.max_iterations = 200, .enough = kEnough}, fit.x);
  fit.converged = end.converged;
  fit.iterations = end.iterations;
  (void)function(fit.x, fit.residuals, &fit.jacobian);
  return fit;
}

JacobianInverse InvertNormal(const Eigen::MatrixXd& jacobian) {
  const Eigen::VectorXd scale = ColumnLengths(jacobian);
  const Eigen::MatrixXd scaled = jacobian * scale.cwiseInverse().asDiagonal();
  const geometry::SingularValues of = geometry::DecomposeSingular(scaled);
  const Eigen::VectorXd& singular = of.values;
  const Eigen::Index last = singular.size() - 1;
  JacobianInverse inverse;
  inverse.weakest = of.v.col(last);
  constexpr double kZero = 1e-150;  // its inverse square is still finite
  const Eigen::VectorXd inverse_singular = singular.cwiseMax(kZero).cwiseInverse();
  const Eigen::MatrixXd root =
      scale.cwiseInverse().asDiagonal() * of.v * inverse_singular.asDiagonal();
  inverse.covariance = root * root.transpose();
  return inverse;
}

}  // namespace trammel::part_alignment

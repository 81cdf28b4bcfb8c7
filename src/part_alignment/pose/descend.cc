#include "part_alignment/pose/descend.h"

#include <cmath>
#include <limits>

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

/// The normal equations at one theta.
struct Normal {
  ThetaMatrix matrix;
  Theta right;
  double chi_square = std::numeric_limits<double>::infinity();
};

bool Build(const PoseProblem& problem, const Theta& theta, Normal& normal) {
  const Chain chain(problem, theta, true);
  normal.matrix.setZero(theta.size(), theta.size());
  normal.right.setZero(theta.size());
  normal.chi_square = 0;
  Eigen::Vector2d residual_px;
  ObservationDerivative derivative;
  for (const WeightedObservation& observation : problem.observations) {
    if (!chain.ResidualAndDerivative(observation, residual_px, derivative)) {
      normal.chi_square = std::numeric_limits<double>::infinity();
      return false;
    }
    const double weight = 1 / (observation.sigma_px * observation.sigma_px);
    normal.matrix.noalias() += weight * derivative.transpose().lazyProduct(derivative);
    normal.right.noalias() += weight * derivative.transpose().lazyProduct(residual_px);
    normal.chi_square += weight * residual_px.squaredNorm();
  }
  return std::isfinite(normal.chi_square);
}

/// The step with each unknown scaled to its own column. The ridge keeps a direction that nothing
/// determines from running away; it costs the others a factor 1e-9 / (their share), some 1e-5, of
/// each step, which the next one makes good.
Theta Step(const Normal& normal, double damping) {
  constexpr double kRidge = 1e-9;
  const Theta scale =
      normal.matrix.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 1.0; });
  ThetaMatrix scaled = scale.asDiagonal() * normal.matrix * scale.asDiagonal();
  scaled.diagonal().array() += kRidge + damping;
  const Theta right = scale.cwiseProduct(normal.right);
  const Theta step = geometry::SolveSmallSymmetric(scaled, right);
  return scale.cwiseProduct(step);
}

}  // namespace

Descent Descend(const PoseProblem& problem, const Theta& start, int most_steps) {
  constexpr double kStill = 1e-16;    // of squared sigmas
  constexpr double kRounding = 1e-9;  // of chi-square, below which a rise means nothing
  constexpr double kFirstDamping = 1e-4;
  constexpr double kLeastDamping = 1e-7;
  constexpr double kMostDamping = 1e12;
  Descent descent{start, std::numeric_limits<double>::infinity(), 0, false};
  Normal here;
  if (!Build(problem, start, here)) {
    return descent;
  }
  Normal there;
  double damping = 0;
  while (descent.steps < most_steps && damping < kMostDamping) {
    const Theta step = Step(here, damping);
    const double promised = step.dot(here.right);
    const Theta next = descent.theta + step;
    ++descent.steps;
    const bool seen = next.allFinite() && Build(problem, next, there);
    const bool still = damping == 0 && promised < kStill;
    if (seen && (there.chi_square <= here.chi_square || still)) {
      descent.theta = next;
      here = there;
      damping = damping / 10 < kLeastDamping ? 0 : damping / 10;
    } else if (promised < kRounding * (1e-6 + here.chi_square) && damping == 0) {
      descent.converged = true;
      break;
    } else {
      damping = damping == 0 ? kFirstDamping : damping * 10;
    }
    if (still) {
      descent.converged = true;
      break;
    }
  }
  descent.chi_square = here.chi_square;
  return descent;
}

}  // namespace trammel::part_alignment

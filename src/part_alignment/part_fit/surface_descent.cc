#include "part_alignment/part_fit/surface_descent.h"

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {

Motion FitSurfaces(const Problem& problem, Motion motion, int most_rounds) {
  constexpr double kStill_mm = 1e-9;
  // Of the cost; what is left of the way is gone by the steps under the least stock allowance.
  const double least_gain = problem.has_mesh ? 1e-6 : 0;
  const Eigen::VectorXd weights = Weights(problem);
  const Eigen::VectorXd wanted = Wanted(problem);
  const auto cost_of = [&](const Linear& linear) {
    return (linear.stock_allowance_mm - wanted).cwiseAbs2().dot(weights);
  };
  Linear linear = Linearise(problem, motion);
  double cost = cost_of(linear);
  double damping = 1e-3;
  for (int round = 0; round < most_rounds && damping < 1e12; ++round) {
    const Eigen::MatrixXd weighted = weights.asDiagonal() * linear.by_motion;
    Eigen::Matrix<double, 6, 6> normal = linear.by_motion.transpose() * weighted;
    normal.diagonal().array() += damping * normal.trace() / 6;
    const Vector6 step = -geometry::SolveSymmetric(
        normal, weighted.transpose() * (linear.stock_allowance_mm - wanted));
    const Motion trial = Moved(motion, linear, step, problem.size_mm);
    Linear there = Linearise(problem, trial);
    const double reached = cost_of(there);
    if (reached <= cost) {
      const bool enough = cost - reached < least_gain * cost;
      motion = trial;
      linear = std::move(there);
      cost = reached;
      damping *= 0.1;
      if (step.norm() < kStill_mm || enough) break;
    } else {
      damping *= 10;
      if (problem.has_mesh && step.norm() < 1e-5) break;
    }
  }
  return motion;
}

}  // namespace trammel::part_alignment

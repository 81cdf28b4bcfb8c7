#include "part_alignment/pose/ceres_descend.h"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <memory>

namespace trammel::part_alignment {
namespace {

/// One observation's residual in sigmas.
class ObservationCost final : public ceres::CostFunction {
 public:
  ObservationCost(const PoseProblem& problem, const WeightedObservation& observation, int unknowns)
      : problem_(problem), observation_(observation), unknowns_(unknowns) {
    set_num_residuals(2);
    mutable_parameter_block_sizes()->push_back(unknowns);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Theta theta = Eigen::Map<const Eigen::VectorXd>(parameters[0], unknowns_);
    const bool derive = jacobians != nullptr && jacobians[0] != nullptr;
    const Chain chain(problem_, theta, derive);
    Eigen::Vector2d residual_px;
    ObservationDerivative derivative;
    if (derive ? !chain.ResidualAndDerivative(observation_, residual_px, derivative)
               : !chain.Residual(observation_, residual_px)) {
      return false;
    }
    Eigen::Map<Eigen::Vector2d>{residuals} = residual_px / observation_.sigma_px;
    if (derive) {
      using RowMajor = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowMajor>(jacobians[0], 2, unknowns_) = -derivative / observation_.sigma_px;
    }
    return true;
  }

 private:
  const PoseProblem& problem_;
  const WeightedObservation& observation_;
  int unknowns_;
};

}  // namespace

Descent DescendByCeres(const PoseProblem& problem, const Theta& start, double loss_sigma) {
  Descent descent{start, ChiSquare(problem, start), 0, false};
  if (!std::isfinite(descent.chi_square)) {
    return descent;
  }
  const int unknowns = static_cast<int>(start.size());
  ceres::Problem ceres_problem;
  for (const WeightedObservation& observation : problem.observations) {
    ceres::LossFunction* loss = loss_sigma > 0 ? new ceres::CauchyLoss(loss_sigma) : nullptr;
    // Ceres owns cost and loss.
    ceres_problem.AddResidualBlock(new ObservationCost(problem, observation, unknowns), loss,
                                   descent.theta.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  options.max_num_iterations = 100;
  // To the rounding: what the answer is worth is said by its covariance, not by where it stopped.
  options.function_tolerance = 1e-24;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-17;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  descent.steps = summary.num_successful_steps + summary.num_unsuccessful_steps;
  descent.converged = summary.IsSolutionUsable();
  descent.chi_square = ChiSquare(problem, descent.theta);
  return descent;
}

}  // namespace trammel::part_alignment

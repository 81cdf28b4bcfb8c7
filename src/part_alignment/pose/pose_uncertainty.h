// What an alignment is worth: linear propagation, and Monte Carlo beside it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "part_alignment/pose/input_uncertainty.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

/// Where the measurement is taken to be: the true values of the simulated measurements.
struct AlignmentState {
  geometry::Pose machine_from_part;
  Clamping clamping;
};

struct LinearUncertainty {
  std::vector<std::string> parameters;  ///< as Alignment::parameters
  Eigen::MatrixXd covariance;
};

/// The solver's weights and derivatives at the state, every input through its own derivative:
/// theta = (J^T W J)^-1 J^T W (inputs), W from the sigmas of the pixels. Only the views' places,
/// the targets and the sigmas of the measurement count; its pixels may be anything. What is among
/// the unknowns adds nothing here. Errors (kInput): as of Solve; an uncertainty that is negative or
/// not finite; targets that the camera does not see from there; views that do not determine the
/// unknowns.
[[nodiscard]] Result<LinearUncertainty> PropagateLinearly(const Measurement& measurement,
                                                          const Unknowns& unknowns,
                                                          const AlignmentState& state,
                                                          const InputUncertainty& inputs);

struct MonteCarloUncertainty {
  std::vector<std::string> parameters;
  Eigen::VectorXd mean_error;  ///< of the solutions, from the truth
  Eigen::MatrixXd covariance;  ///< of the solutions
  Eigen::VectorXd low95;       ///< 2.5 and 97.5 % quantiles of the errors
  Eigen::VectorXd high95;
  double inside95 = 0;  ///< share of the errors within the 95 % region of the linear covariance
  int trials = 0;       ///< that counted
  int failed = 0;       ///< that did not converge, or saw a target no more
};

/// GUM supplement 1: draws every input `trials` times, takes the pictures anew and solves each of
/// them fully (from the state, so it tells nothing of first guesses). Angles' errors are taken
/// around the truth. Cost: some 20 us a trial of 8 sights. Errors as of PropagateLinearly; trials
/// must lie in 100 ... 10,000,000.
[[nodiscard]] Result<MonteCarloUncertainty> SimulateMeasurements(const Measurement& measurement,
                                                                 const Unknowns& unknowns,
                                                                 const AlignmentState& state,
                                                                 const InputUncertainty& inputs,
                                                                 int trials, Random& random);

}  // namespace trammel::part_alignment

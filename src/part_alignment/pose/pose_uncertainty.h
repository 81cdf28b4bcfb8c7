// What an alignment is worth: linear propagation, and Monte Carlo beside it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "part_alignment/pose/measurement.h"
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

/// The covariance that Solve states, at a state instead of an answer: of pixels and inputs together
/// (joint_fit.h), the machine's repeatability as stated or usual. Of the options unknowns
/// and what is uncertain count; of the measurement camera, targets, the views' places and the
/// sigmas; its pixels may be anything. Errors (kInput): as of Solve; targets that the camera does
/// not see from there; views that do not determine the unknowns.
[[nodiscard]] Result<LinearUncertainty> PropagateLinearly(const Measurement& measurement,
                                                          const SolveOptions& options,
                                                          const AlignmentState& state);

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
/// them fully (from the state, so it tells nothing of first guesses or wrong targets). Angles'
/// errors are taken around the truth. Cost: some 20 us a trial of 8 observations. Errors as of
/// PropagateLinearly; trials must lie in 100 ... 1,000,000.
[[nodiscard]] Result<MonteCarloUncertainty> SimulateMeasurements(const Measurement& measurement,
                                                                 const SolveOptions& options,
                                                                 const AlignmentState& state,
                                                                 int trials, Random& random);

/// The same about an answer, without the observations that it left out. REQUIRES an answer of this
/// measurement and these options with verdict good.
[[nodiscard]] Result<MonteCarloUncertainty> SimulateAnswer(const Measurement& measurement,
                                                           const SolveOptions& options,
                                                           const Alignment& alignment, int trials,
                                                           Random& random);

/// What a simulation says against the linear covariance of its answer: a parameter's scatter that
/// is not the stated one, or a joint region that holds another share than it should. Absent where
/// both agree to 10 % and 2 %, or to four times what so many trials are known to.
[[nodiscard]] std::optional<std::string> NoticeOfSimulation(const Alignment& alignment,
                                                            const MonteCarloUncertainty& simulated);

struct Contribution {
  std::string input;   ///< of InputUncertainty, "targets", "camera", "all" or "pixels"
  double size = 0;     ///< k = 1, mm or rad; 0 where it is a covariance, or none of its own
  bool usual = false;  ///< nobody stated its size
  /// k = 1 of the part's x, y, z in the machine: of "all" as stated, of "pixels" were all else
  /// exact, of any other were this one exact.
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();
};

/// "all" first, then what counts, the largest first, "pixels" last. Empty unless the verdict is
/// good. By linear propagation at the answer (pose_uncertainty.h): the weights follow what counts,
/// so that the parts need not add up. REQUIRES an answer of this measurement and these options.
[[nodiscard]] std::vector<Contribution> ContributionsOf(const Measurement& measurement,
                                                        const SolveOptions& options,
                                                        const Alignment& alignment);

}  // namespace trammel::part_alignment

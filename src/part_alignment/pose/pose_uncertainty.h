// Uncertainty of an alignment: linear propagation, and Monte Carlo beside it.
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

/// Assumed true values of the simulated measurements.
struct AlignmentState {
  geometry::Pose machine_from_part;
  Clamping clamping;
};

struct LinearUncertainty {
  std::vector<std::string> parameters;  ///< like Alignment::parameters
  Eigen::MatrixXd covariance;
};

/// Computes Solve's covariance at a state instead of a solution: of pixels and inputs together
/// (joint_fit.h), with the machine's repeatability as stated or usual. Uses unknowns and
/// uncertainties of the options; camera, targets, the views' places and the sigmas of the
/// measurement; its pixels may be anything. Errors (kInput): as of Solve; targets that the camera
/// does not see from there; views that do not determine the unknowns.
[[nodiscard]] Result<LinearUncertainty> PropagateLinearly(const Measurement& measurement,
                                                          const SolveOptions& options,
                                                          const AlignmentState& state);

struct MonteCarloUncertainty {
  std::vector<std::string> parameters;
  Eigen::VectorXd mean_error;  ///< solutions less truth
  Eigen::MatrixXd covariance;  ///< covariance of solutions
  Eigen::VectorXd low95;       ///< 2.5 and 97.5 % quantiles of the errors
  Eigen::VectorXd high95;
  double inside95 = 0;  ///< share of the errors within the 95 % region of the linear covariance
  int trials = 0;       ///< successful trials
  int failed = 0;       ///< did not converge, or lost sight of a target
};

/// Simulates after GUM supplement 1: draws every input `trials` times, takes the pictures anew and
/// solves each of them fully. It starts at the state, so it does not test first guesses or wrong
/// targets. Angles' errors are taken around the truth. Cost: some 20 us a trial of 8 observations.
/// Errors as of PropagateLinearly; trials outside 100 ... 1,000,000.
[[nodiscard]] Result<MonteCarloUncertainty> SimulateMeasurements(const Measurement& measurement,
                                                                 const SolveOptions& options,
                                                                 const AlignmentState& state,
                                                                 int trials, Random& random);

/// Simulates about a solution, without the observations that it excluded. REQUIRES a solution of
/// this measurement and these options with verdict good.
[[nodiscard]] Result<MonteCarloUncertainty> SimulateAnswer(const Measurement& measurement,
                                                           const SolveOptions& options,
                                                           const Alignment& alignment, int trials,
                                                           Random& random);

/// Compares a simulation with the linear covariance: a notice names a parameter's scatter, or a
/// joint region's share, that differs. Absent if both agree to 10 % and 2 %, or to four times the
/// uncertainty of so many trials.
[[nodiscard]] std::optional<std::string> NoticeOfSimulation(const Alignment& alignment,
                                                            const MonteCarloUncertainty& simulated);

struct Contribution {
  std::string input;   ///< name in InputUncertainty, or "targets", "camera", "all", "pixels"
  double size = 0;     ///< k = 1, mm or rad; 0 where it is a covariance, or none of its own
  bool usual = false;  ///< nobody stated its size
  /// Uncertainty, k = 1, of the part's x, y, z in the machine. "all": as stated; "pixels": if all
  /// else were exact; any other: if that input were exact.
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();
};

/// "all" first, then what counts, the largest first, "pixels" last. Empty unless the verdict is
/// good. By linear propagation at the answer (pose_uncertainty.h): the weights follow what counts,
/// so that the parts need not add up. REQUIRES an answer of this measurement and these options.
[[nodiscard]] std::vector<Contribution> ContributionsOf(const Measurement& measurement,
                                                        const SolveOptions& options,
                                                        const Alignment& alignment);

}  // namespace trammel::part_alignment

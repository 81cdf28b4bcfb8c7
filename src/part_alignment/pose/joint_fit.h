// Residuals fitted together with the errors of the inputs that they share.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Generalised least squares, linear about a theta: of all changes of theta and all errors of the
/// inputs the likeliest together.
struct JointFit {
  double chi_square = 0;       ///< of what is left over, with DegreesOfFreedom
  Theta step;                  ///< to be added to theta
  Eigen::MatrixXd covariance;  ///< of theta + step; of size 0 below full rank, as are the next two
  Eigen::MatrixXd gain;        ///< step = gain · residuals (px, two of each observation)
  /// What the errors of WithEverything's theta are estimated as, 0 where they do not count.
  Theta common;
};

/// The observations' noise is WeightedObservation::pixel_sigma_px; of PoseProblem::errors the
/// machine's is one error for each view, a target's one for all its observations, the camera's and
/// the common ones one for the whole measurement. chi_square is infinite, and all else empty, where
/// a target is not seen at theta. Cost: O(observations · (unknowns + errors)²), the machine's
/// errors not counted.
[[nodiscard]] JointFit FitJointly(const PoseProblem& problem, const Theta& theta);

/// The same, its chi-square alone.
[[nodiscard]] double JointChiSquare(const PoseProblem& problem, const Theta& theta);

/// JointChiSquare as it follows from the machine's error (mm) alone, that of PoseProblem::errors
/// left out: each call after the first costs no derivatives.
[[nodiscard]] std::function<double(double machine_mm)> JointChiSquareByMachine(
    const PoseProblem& problem, const Theta& theta);

/// The directions of the residuals that targets' errors reach and no unknown takes up, those of the
/// other inputs whitened away.
struct TargetDirections {
  Eigen::VectorXd reach;  ///< σ by which errors of their stated size move the residuals along each
  Eigen::VectorXd residual;  ///< σ along each, the targets' own share not counted as noise
};

/// Of the errors in PoseProblem::errors.targets; empty without any, or where a target is not seen.
/// Chi-square along them is Σ residual² / (1 + reach²). Cost: O((3 · targets)³).
[[nodiscard]] TargetDirections DirectionsOfTargets(const PoseProblem& problem, const Theta& theta);

}  // namespace trammel::part_alignment

// Residuals fitted together with the errors of the inputs that they share.
#pragma once

#include <Eigen/Core>

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Generalised least squares, linear about a theta: of all changes of theta and all errors of the
/// inputs the likeliest together.
struct JointFit {
  double chi_square = 0;       ///< of what is left over, with DegreesOfFreedom
  Theta step;                  ///< to be added to theta
  Eigen::MatrixXd covariance;  ///< of theta + step; of size 0 below full rank, as are the next two
  Eigen::MatrixXd gain;        ///< step = gain · residuals (px, two of each sight)
  /// What the errors of WithEverything's theta are estimated as, 0 where they do not count.
  Theta common;
};

/// The sights' noise is Sight::pixel_sigma_px; of PoseProblem::errors the machine's is one error
/// for each view, a target's one for all its sights, the camera's and the common ones one for the
/// whole measurement. chi_square is infinite, and all else empty, where a target is not seen at
/// theta. Cost: O(sights · (unknowns + errors)²), the machine's errors not counted.
[[nodiscard]] JointFit FitJointly(const PoseProblem& problem, const Theta& theta);

/// The same, its chi-square alone.
[[nodiscard]] double JointChiSquare(const PoseProblem& problem, const Theta& theta);

}  // namespace trammel::part_alignment

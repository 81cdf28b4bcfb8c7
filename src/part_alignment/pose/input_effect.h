// How the inputs of a measurement move its answer.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "part_alignment/camera/camera_parameters.h"
#include "part_alignment/pose/input_uncertainty.h"
#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// The problem with everything unknown that can be.
[[nodiscard]] PoseProblem WithEverything(const PoseProblem& problem);

/// Its theta at `theta` of the problem: what is not solved for as the solver takes it.
[[nodiscard]] Theta EverythingAt(const PoseProblem& problem, const Theta& theta);

/// The standard uncertainty of each entry of WithEverything's theta that is not solved for, else 0.
[[nodiscard]] Theta CommonSigmas(const InputUncertainty& inputs, const Unknowns& unknowns);

/// The sights' sigmas with the share of machine and targets at their distance, so that weights and
/// chi-square count them; Sight::pixel_sigma_px keeps the stated one. Errors that sights share
/// count as if they did not: chi-square is then rather smaller than its degrees of freedom.
void WidenSigmas(const Theta& theta, const InputUncertainty& inputs, PoseProblem& problem);

/// geometry::CovarianceRoot, but for what is solved for of the camera: that does not count.
[[nodiscard]] CameraCovariance CountingRoot(const Unknowns& unknowns,
                                            const CameraCovariance& covariance);

/// PoseProblem::shared of an uncertain camera at theta; 0 where a target is not seen.
[[nodiscard]] std::vector<SharedMove> CameraMoves(const PoseProblem& problem, const Theta& theta,
                                                  const CameraCovariance& covariance);

/// Covariance of theta by all inputs, the pixels' and the shared ones as what they are. Empty below
/// full rank.
[[nodiscard]] Eigen::MatrixXd CovarianceByInputs(const PoseProblem& problem, const Theta& theta,
                                                 const InputUncertainty& inputs,
                                                 const std::optional<CameraCovariance>& camera);

}  // namespace trammel::part_alignment

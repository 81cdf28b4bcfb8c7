// How the inputs of a measurement move its answer.
#pragma once

#include <Eigen/Core>
#include <optional>

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

/// theta changes by this matrix times the change of the weighted residuals. Empty below full rank.
[[nodiscard]] Eigen::MatrixXd Gain(const PoseProblem& problem, const Theta& theta);

/// What the inputs do to theta: a column for each independent draw, times its sigma.
[[nodiscard]] Eigen::MatrixXd InputMoves(const PoseProblem& problem, const Theta& theta,
                                         const InputUncertainty& inputs,
                                         const Eigen::MatrixXd& gain);

/// The sights' sigmas with the share of machine and targets at their distance, so that weights and
/// chi-square count them; Sight::pixel_sigma_px keeps the stated one. Errors that sights share
/// count as if they did not: chi-square is then rather smaller than its degrees of freedom.
void WidenSigmas(const Theta& theta, const InputUncertainty& inputs, PoseProblem& problem);

/// What the camera's calibration does to the projected places, in the sights' sigmas: a row for
/// each, a column for each independent draw, times its sigma. What is solved for of the camera is
/// left out. REQUIRES a covariance that is one, and that all targets are seen.
[[nodiscard]] Eigen::MatrixXd CameraMoves(const PoseProblem& problem, const Theta& theta,
                                          const CameraCovariance& covariance);

/// The sights' sigmas with what no pose takes up of an uncertain camera.
void WidenByCamera(const Theta& theta, const CameraCovariance& covariance, PoseProblem& problem);

/// Covariance of theta by all inputs, the pixels' and the shared ones as what they are. Empty below
/// full rank.
[[nodiscard]] Eigen::MatrixXd CovarianceByInputs(const PoseProblem& problem, const Theta& theta,
                                                 const InputUncertainty& inputs,
                                                 const std::optional<CameraCovariance>& camera);

}  // namespace trammel::part_alignment

// How the inputs of a measurement move its answer.
#pragma once

#include <Eigen/Core>
#include <cstddef>
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
/// REQUIRES inputs with all sizes.
[[nodiscard]] Theta CommonSigmas(const InputUncertainty& inputs, const Unknowns& unknowns);

/// What counts as uncertain in a problem. REQUIRES inputs with all sizes (WithUsualSizes).
/// @param targets  of their coordinates, (3 · targets)², mm²; absent: independent, by target_mm
[[nodiscard]] InputErrors ErrorsOf(const InputUncertainty& inputs, const Unknowns& unknowns,
                                   std::size_t target_count,
                                   const std::optional<Eigen::MatrixXd>& targets,
                                   const std::optional<CameraCovariance>& camera);

/// The observations' sigmas with the share of machine and targets at their distance, by which they
/// weigh in the search for the pose; WeightedObservation::pixel_sigma_px keeps the stated one.
void InflateSigmas(const Theta& theta, PoseProblem& problem);

/// geometry::CovarianceRoot, but for what is solved for of the camera: that does not count.
[[nodiscard]] CameraCovariance CountingRoot(const Unknowns& unknowns,
                                            const CameraCovariance& covariance);

/// How an observation's projected place moves, px, with each of the independent draws of unit
/// variance that make up an uncertain calibration: the same draws for all observations.
using CameraMove = Eigen::Matrix<double, 2, kCameraParameters>;

/// One for each observation, of a camera with this root at theta; 0 where a target is not seen.
[[nodiscard]] std::vector<CameraMove> CameraMoves(const PoseProblem& problem, const Theta& theta,
                                                  const CameraCovariance& root);

}  // namespace trammel::part_alignment

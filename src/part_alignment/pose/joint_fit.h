// Effect of a measurement's input errors on its answer.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "part_alignment/camera/camera.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Returns the problem with all possible unknowns.
[[nodiscard]] PoseProblem WithEverything(const PoseProblem& problem);

/// Returns its theta at `theta` of the problem; entries not solved for have the solver's values.
[[nodiscard]] Theta EverythingAt(const PoseProblem& problem, const Theta& theta);

/// Returns the standard uncertainty of each entry of WithEverything's theta that is not solved for,
/// else 0. REQUIRES inputs with all sizes.
[[nodiscard]] Theta CommonSigmas(const InputUncertainty& inputs, const Unknowns& unknowns);

/// Collects uncertain inputs. REQUIRES inputs with all sizes (WithUsualSizes).
/// @param targets  of their coordinates, (3 · targets)², mm²; absent: independent, by target_mm
[[nodiscard]] InputErrors ErrorsOf(const InputUncertainty& inputs, const Unknowns& unknowns,
                                   std::size_t target_count,
                                   const std::optional<Eigen::MatrixXd>& targets,
                                   const std::optional<CameraCovariance>& camera);

/// Computes the observations' sigmas with the share of machine and targets at their distance, as
/// weights of the search for the pose. WeightedObservation::pixel_sigma_px retains the stated one.
void InflateSigmas(const Theta& theta, PoseProblem& problem);

/// Computes geometry::CovarianceRoot without the camera parameters that are solved for: those do
/// not count.
[[nodiscard]] CameraCovariance CountingRoot(const Unknowns& unknowns,
                                            const CameraCovariance& covariance);

/// Shift of an observation's projection, px, by each independent draw of unit variance of an
/// uncertain calibration: the same draws for all observations.
using CameraMove = Eigen::Matrix<double, 2, kCameraParameters>;

/// Computes one move for each observation, of a camera with this root at theta; 0 where a target is
/// not visible.
[[nodiscard]] std::vector<CameraMove> CameraMoves(const PoseProblem& problem, const Theta& theta,
                                                  const CameraCovariance& root);

/// Generalised least squares, linear about a theta: the most likely combination of a change of
/// theta and errors of the inputs.
struct JointFit {
  double chi_square = 0;       ///< of the remaining residuals, with DegreesOfFreedom
  Theta step;                  ///< increment of theta
  Eigen::MatrixXd covariance;  ///< of theta + step; size 0 below full rank, as the next two
  Eigen::MatrixXd gain;        ///< step = gain · residuals (px, two of each observation)
  /// Estimated errors of WithEverything's theta, 0 where they do not count.
  Theta common;
};

/// Fits with the observations' noise WeightedObservation::pixel_sigma_px. Of PoseProblem::errors,
/// the machine's is one error for each view, a target's one for all its observations, the camera's
/// and the common ones one for the whole measurement. chi_square is infinite, and all else empty,
/// if a target is not visible at theta. Cost: O(observations · (unknowns + errors)²), the machine's
/// errors not counted.
[[nodiscard]] JointFit FitJointly(const PoseProblem& problem, const Theta& theta);

/// Computes the chi-square of FitJointly alone.
[[nodiscard]] double JointChiSquare(const PoseProblem& problem, const Theta& theta);

/// Returns JointChiSquare as a function of the machine's error (mm), which replaces that of
/// PoseProblem::errors. Calls after the first compute no derivatives.
[[nodiscard]] std::function<double(double machine_mm)> JointChiSquareByMachine(
    const PoseProblem& problem, const Theta& theta);

/// Directions of the residuals that targets' errors reach and no unknown absorbs, with the other
/// inputs' directions whitened.
struct TargetDirections {
  Eigen::VectorXd reach;  ///< σ by which errors of their stated size move the residuals along each
  Eigen::VectorXd residual;  ///< σ along each, the targets' own share not counted as noise
};

/// Returns directions of PoseProblem::errors.targets; empty without any, or if a target is not
/// visible. Chi-square along them is Σ residual² / (1 + reach²). Cost: O((3 · targets)³).
[[nodiscard]] TargetDirections DirectionsOfTargets(const PoseProblem& problem, const Theta& theta);

/// Upper limit of a machine's repeatability, per axis, k = 1: larger residuals have another cause.
constexpr double kWorstRepeatability_mm = 0.010;

/// Estimates the repeatability of the machine's axes (mm, k = 1) from a fit's residuals, with usual
/// machines as prior: kUsualRepeatability_mm, as if from four trial runs. With few degrees of
/// freedom a scatter is uncertain, and a region by it would be too small. So the estimate puts
/// chi-square, trial runs included, at the quantile that one in ten falls below. At most twice
/// kWorstRepeatability_mm. Of PoseProblem::errors all but the machine's counts.
/// @param targets_known  false: the size of the targets' errors is unknown, so residuals which they
/// can explain do not count for the machine
[[nodiscard]] double RepeatabilityByResiduals(const PoseProblem& problem, const Theta& theta,
                                              bool targets_known);

/// Estimates the standard deviation (mm, k = 1) of each coordinate of each target from a fit's
/// residuals, at least `usual_mm`. Few targets determine their scatter badly. So the estimate puts
/// their share of chi-square, along the directions in which `usual_mm` would show, at the quantile
/// that `share` of samples fall below. `usual_mm` if no residual shows the targets' errors.
/// @param problem  its errors.targets those of usual_mm, independent; all else as it counts
/// @param share    0.0001 ... 0.5
[[nodiscard]] double TargetErrorByResiduals(const PoseProblem& problem, const Theta& theta,
                                            double usual_mm, double share);

}  // namespace trammel::part_alignment

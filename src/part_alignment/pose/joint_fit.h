// How the inputs of a measurement move its answer.
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

/// The worst that a machine is taken to repeat, per axis, k = 1: residuals that contradict it are
/// contradicted by something else.
constexpr double kWorstRepeatability_mm = 0.010;

/// Repeatability of the machine's axes (mm, k = 1) that the residuals of a fit ask for, beside what
/// is known of usual machines: kUsualRepeatability_mm, as if from four trial runs. Of few degrees
/// of freedom a scatter is badly known, and a region stated by it would hold too little; so it is
/// taken as large as puts chi-square, trial runs and all, to what one in ten falls below. At most
/// twice kWorstRepeatability_mm. Of PoseProblem::errors all but the machine's counts.
/// @param targets_known  false: the targets' errors are of no known size, so that residuals which
///                       they can explain tell nothing of the machine
[[nodiscard]] double RepeatabilityByResiduals(const PoseProblem& problem, const Theta& theta,
                                              bool targets_known);

/// Standard deviation (mm, k = 1) of each coordinate of each target that the residuals of a fit ask
/// for, at least `usual_mm`. Few targets tell little of their scatter: so it is taken as large as
/// puts their share of chi-square, along the directions in which `usual_mm` would show, to what
/// `share` of samples fall below. `usual_mm` where no residual shows the targets' errors.
/// @param problem  its errors.targets those of usual_mm, independent; all else as it counts
/// @param share    0.0001 ... 0.5
[[nodiscard]] double TargetErrorByResiduals(const PoseProblem& problem, const Theta& theta,
                                            double usual_mm, double share);

}  // namespace trammel::part_alignment

// The least-squares problem behind an alignment: residuals and their derivatives.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/camera/camera.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

constexpr int kMostUnknowns = 15;
/// Values of the unknowns: x y z (mm) alpha beta gamma (rad), then those asked for, in the order of
/// Unknowns. No heap: the hot path makes many.
using Theta = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknowns, 1>;
using ThetaMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknowns, kMostUnknowns>;
using ObservationDerivative = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostUnknowns>;

/// Where each unknown stands in Theta; -1: not asked for.
struct Layout {
  int clamp_angle = -1;
  int clamp_eccentricity = -1;
  int clamp_tilt = -1;
  int focal_length = -1;
  int camera_offset = -1;
  int size = 6;
};
[[nodiscard]] Layout LayoutOf(const Unknowns& unknowns);

/// Names with units, as in Alignment::parameters.
[[nodiscard]] std::vector<std::string> ParameterNames(const Unknowns& unknowns);
/// For people, in the same order: "the part's X", "the clamp angle".
[[nodiscard]] std::vector<std::string> UnknownNames(const Unknowns& unknowns);

/// One line of sight: a target seen in a view.
struct WeightedObservation {
  Eigen::Vector3d part_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_from_machine = Eigen::Matrix3d::Identity();  ///< R_cnc^T
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();                ///< d_cnc
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1;        ///< its weight is one over the square
  double pixel_sigma_px = 1;  ///< as stated, without the share of machine and targets
  std::size_t view = 0;
  std::size_t target = 0;
};

/// What is uncertain beside the pixels; covariances as their roots, which make them of independent
/// draws of unit variance.
struct InputErrors {
  double machine_mm = 0;    ///< each axis of each view's spindle position
  Theta common;             ///< CommonSigmas; empty: all 0
  Eigen::MatrixXd targets;  ///< (3 · targets, draws), in the part's own frame; empty: exact
  std::optional<CameraCovariance> camera;  ///< CountingRoot
};

struct PoseProblem {
  Camera camera;
  Unknowns unknowns;
  std::vector<WeightedObservation> observations;  ///< those of a view are neighbours
  InputErrors errors = {};
};

/// The problem without some of its observations.
[[nodiscard]] PoseProblem Without(const PoseProblem& problem,
                                  const std::vector<std::size_t>& left_out);

/// What does not change from observation to observation at one theta.
class Chain {
 public:
  Chain(const PoseProblem& problem, const Theta& theta, bool with_derivatives);

  /// Measured minus projected, px. False where the camera cannot see the target.
  [[nodiscard]] bool Residual(const WeightedObservation& observation,
                              Eigen::Vector2d& residual_px) const;
  /// The same with the derivative of the *projected* place by theta (minus that of the residual).
  /// REQUIRES with_derivatives.
  [[nodiscard]] bool ResidualAndDerivative(const WeightedObservation& observation,
                                           Eigen::Vector2d& residual_px,
                                           ObservationDerivative& derivative) const;

 private:
  Eigen::Vector3d SpindlePoint(const WeightedObservation& observation) const;

  Layout layout_;
  Camera camera_;
  Eigen::Vector3d translation_mm_;
  Eigen::Vector2d eccentricity_mm_;
  Eigen::Matrix3d machine_from_part_;
  Eigen::Matrix3d camera_from_taper_;
  Eigen::Matrix3d camera_from_spindle_;
  std::array<Eigen::Matrix3d, 3> by_part_angle_;
  Eigen::Matrix3d by_clamp_angle_;
  std::array<Eigen::Matrix3d, 2> by_tilt_;
};

/// Theta of a pose, with the camera's own focal length and offset and the given clamping.
[[nodiscard]] Theta ThetaOf(const PoseProblem& problem, const geometry::Pose& machine_from_part,
                            const Clamping& clamping);
[[nodiscard]] geometry::Pose PoseOf(const Theta& theta);
[[nodiscard]] Clamping ClampingOf(const Layout& layout, const Theta& theta);
/// The problem's camera with what theta has of it.
[[nodiscard]] Camera CameraOf(const PoseProblem& problem, const Theta& theta);

/// The whole Jacobian of the projected places, each row divided by its sigma: (2 · observations,
/// unknowns). Empty where a target cannot be seen.
[[nodiscard]] Eigen::MatrixXd WeightedJacobian(const PoseProblem& problem, const Theta& theta);

/// Sum of squared residuals in sigmas; infinite where a target cannot be seen.
[[nodiscard]] double ChiSquare(const PoseProblem& problem, const Theta& theta);

/// The part's frame moved to the middle of the targets and turned, so that the angles of a solution
/// nearby are small (no gimbal lock) and translation and rotation hardly correlate.
struct MiddleFrame {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
};
[[nodiscard]] PoseProblem InMiddleFrame(const PoseProblem& problem, const MiddleFrame& frame);
/// Theta of the problem in its own frame, from theta in the middle frame; and back.
[[nodiscard]] Theta FromMiddleFrame(const MiddleFrame& frame, const Theta& theta);
[[nodiscard]] Theta ToMiddleFrame(const MiddleFrame& frame, const Theta& theta);
/// Middle of the observations' targets, turned as in `machine_from_part`.
[[nodiscard]] MiddleFrame MiddleFrameOf(const PoseProblem& problem,
                                        const Eigen::Matrix3d& machine_from_part);

/// Errors (kInput) say what a covariance of the targets' coordinates is not: of their size, of
/// numbers, symmetric, nowhere below 0.
[[nodiscard]] Result<void> ValidateTargetCovariance(const Eigen::MatrixXd& covariance,
                                                    std::size_t target_count);

/// The options' inputs as they count for a measurement: usual sizes in place of what is not stated.
[[nodiscard]] InputUncertainty CountedInputs(const Measurement& measurement,
                                             const SolveOptions& options);

/// With the errors of the inputs, usual sizes in place of what is not stated. The errors are those
/// of Solve, as below.
[[nodiscard]] Result<PoseProblem> MakeProblem(const Measurement& measurement,
                                              const SolveOptions& options);

/// Without errors of inputs.
[[nodiscard]] Result<PoseProblem> MakeProblem(const Measurement& measurement,
                                              const Unknowns& unknowns);

}  // namespace trammel::part_alignment

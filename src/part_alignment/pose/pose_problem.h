// Least-squares problem of an alignment: residuals and their derivatives.
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

constexpr int kMaxUnknowns = 15;
/// Values of the unknowns: x y z (mm) alpha beta gamma (rad), then the optional ones, in the order
/// of Unknowns. No heap: the hot path makes many.
using Theta = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxUnknowns, 1>;
using ThetaMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxUnknowns, kMaxUnknowns>;
using ObservationDerivative = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMaxUnknowns>;

/// Index of each unknown in Theta; -1: not solved for.
struct Layout {
  int clamp_angle = -1;
  int clamp_eccentricity = -1;
  int clamp_tilt = -1;
  int focal_length = -1;
  int camera_offset = -1;
  int size = 6;
};
[[nodiscard]] Layout LayoutOf(const Unknowns& unknowns);

/// Returns names with units, as in Alignment::parameters.
[[nodiscard]] std::vector<std::string> ParameterNames(const Unknowns& unknowns);
/// Returns names for people, in the same order: "the part's X", "the clamp angle".
[[nodiscard]] std::vector<std::string> UnknownNames(const Unknowns& unknowns);

/// Line of sight: a target observed in a view.
struct WeightedObservation {
  Eigen::Vector3d part_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_from_machine = Eigen::Matrix3d::Identity();  ///< R_cnc^T
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();                ///< d_cnc
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1;        ///< weight: 1 / sigma_px^2
  double pixel_sigma_px = 1;  ///< as stated, without machine and target errors
  std::size_t view = 0;
  std::size_t target = 0;
};

/// Input errors beside the pixels; covariances as their roots, which make them of independent draws
/// of unit variance.
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

/// Returns the problem without some of its observations.
[[nodiscard]] PoseProblem Without(const PoseProblem& problem,
                                  const std::vector<std::size_t>& left_out);

/// Quantities common to all observations at one theta.
class Chain {
 public:
  Chain(const PoseProblem& problem, const Theta& theta, bool with_derivatives);

  /// Computes measured minus projected, px. False if the camera cannot see the target.
  [[nodiscard]] bool Residual(const WeightedObservation& observation,
                              Eigen::Vector2d& residual_px) const;
  /// Computes the residual and the derivative of the *projected* place by theta (minus that of the
  /// residual). REQUIRES with_derivatives.
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

/// Returns theta of a pose, with the camera's own focal length and offset and the given clamping.
[[nodiscard]] Theta ThetaOf(const PoseProblem& problem, const geometry::Pose& machine_from_part,
                            const Clamping& clamping);
[[nodiscard]] geometry::Pose PoseOf(const Theta& theta);
[[nodiscard]] Clamping ClampingOf(const Layout& layout, const Theta& theta);
/// Returns the problem's camera with the values that theta has of it.
[[nodiscard]] Camera CameraOf(const PoseProblem& problem, const Theta& theta);

/// Computes the whole Jacobian of the projected places, each row divided by its sigma: (2 ·
/// observations, unknowns). Empty if a target is not visible.
[[nodiscard]] Eigen::MatrixXd WeightedJacobian(const PoseProblem& problem, const Theta& theta);

/// Computes the sum of squared residuals in sigmas; infinite if a target is not visible.
[[nodiscard]] double ChiSquare(const PoseProblem& problem, const Theta& theta);

/// Part's frame, moved to the middle of the targets and rotated. Angles of a solution nearby are
/// then small (no gimbal lock), and translation and rotation hardly correlate.
struct MiddleFrame {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
};
[[nodiscard]] PoseProblem InMiddleFrame(const PoseProblem& problem, const MiddleFrame& frame);
/// Converts theta from the middle frame to the problem's own frame, and back.
[[nodiscard]] Theta FromMiddleFrame(const MiddleFrame& frame, const Theta& theta);
[[nodiscard]] Theta ToMiddleFrame(const MiddleFrame& frame, const Theta& theta);
/// Returns the frame at the middle of the observations' targets, rotated as in `machine_from_part`.
[[nodiscard]] MiddleFrame MiddleFrameOf(const PoseProblem& problem,
                                        const Eigen::Matrix3d& machine_from_part);

/// Checks a covariance of the targets' coordinates. Errors (kInput) report a wrong size, entries
/// that are no numbers, asymmetry, a variance below 0.
[[nodiscard]] Result<void> ValidateTargetCovariance(const Eigen::MatrixXd& covariance,
                                                    std::size_t target_count);

/// Returns the options' inputs with usual sizes in place of those that are not stated.
[[nodiscard]] InputUncertainty CountedInputs(const Measurement& measurement,
                                             const SolveOptions& options);

/// Makes a problem with input errors; usual sizes replace those not stated. The errors are those of
/// Solve, as below.
[[nodiscard]] Result<PoseProblem> MakeProblem(const Measurement& measurement,
                                              const SolveOptions& options);

/// Makes a problem without input errors.
[[nodiscard]] Result<PoseProblem> MakeProblem(const Measurement& measurement,
                                              const Unknowns& unknowns);

}  // namespace trammel::part_alignment

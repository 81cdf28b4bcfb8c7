// Measurement of a part: its targets, their pictures, and the uncertainty of its inputs.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

/// Target on the part, at its ideal place.
struct PartTarget {
  std::string id;
  Eigen::Vector3d ideal_mm = Eigen::Vector3d::Zero();
};

/// A target's centre in a picture (of its image, corrected for perspective).
struct Observation {
  std::string target;
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< per axis, k = 1
};

/// Picture from a spindle position in machine coordinates: d_cnc and R_cnc.
struct View {
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_rotation = Eigen::Matrix3d::Identity();
  std::vector<Observation> observations;
};

struct Measurement {
  Camera camera;
  std::vector<PartTarget> targets;
  std::vector<View> views;
};

/// Clamping of the camera in the spindle:
/// x_spindle = Rz(-angle) · Rx(tilt.x) · Ry(tilt.y) · x_taper + (eccentricity, 0).
struct Clamping {
  double angle_rad = 0;  ///< gamma_s; note the sign: the taper is turned by -gamma_s
  Eigen::Vector2d eccentricity_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
};

/// Computes the whole chain: a point of the part in the camera's frame (mm),
/// U = R_cal^T [ R_s^T ( R_cnc^T (R_p X + d_p - d_cnc) - eccentricity ) - d_cal ].
[[nodiscard]] Eigen::Vector3d CameraFromPart(const Camera& camera, const Clamping& clamping,
                                             const View& view,
                                             const geometry::Pose& machine_from_part,
                                             const Eigen::Vector3d& part_mm);

/// Default standard uncertainty of a camera's centre against the spindle's axis, X and Y each.
/// Table 3 of Mendikute et al. (X and Y repeat to 0.030 mm, k = 2, whatever the pictures) needs
/// 0.015 mm from clamping to clamping. The clamping of the calibration is off as much: a factor of
/// the root of 2. Ten repeats determine a standard deviation only so well: a factor of the root of
/// 9/7 (that of Student's t with nine degrees of freedom, GUM supplement 1, 6.4.9). Includes the
/// effect of a tilt of the taper at the targets' distance.
constexpr double kUsualEccentricity_mm = 0.024;
/// Default repeatability of each axis of a machine: the remainder of Table 3's Z and angles (0.0028
/// … 0.0037 mm).
constexpr double kUsualRepeatability_mm = 0.004;
/// Uncertainty of the camera's position in its taper, X, Y and Z each, if its file has no
/// covariance. Source: probing the taper, or touching a mark on the machine.
constexpr double kUsualCameraOffset_mm = 0.010;
/// Returns the usual uncertainty of a target's coordinate without stated size or covariance.
/// Lengths are wrong by up to 50 µm + 20 µm/m, typical of portable photogrammetry (Luhmann et al.
/// 2011, the budget's default), rectangular; each end has a root of two less.
/// @param extent_mm  the diagonal of the box about all targets
[[nodiscard]] double UsualTarget_mm(double extent_mm);

/// Standard uncertainties (k = 1) of a measurement's inputs beside the pixels' own sigmas; all
/// normal, 0: exact. An absent value counts with its usual size, never as 0.
struct InputUncertainty {
  /// Uncertainty of each axis of each view's spindle position, independent. Absent:
  /// kUsualRepeatability_mm, and an estimate by the residuals (joint_fit.h).
  std::optional<double> machine_mm;
  /// Uncertainty of each coordinate of each target, the same in all views. Absent: UsualTarget_mm,
  /// or more if the residuals require it (joint_fit.h); 0 beside a covariance of the targets.
  std::optional<double> target_mm;
  // One value for the whole measurement; counts only if it is not among the unknowns.
  std::optional<double> clamp_angle_rad;        ///< absent: 0, likewise below
  std::optional<double> clamp_eccentricity_mm;  ///< X and Y each; absent: kUsualEccentricity_mm
  std::optional<double> clamp_tilt_rad;         ///< about X and Y each
  std::optional<double> focal_length_mm;
  /// Uncertainty of X, Y and Z each; absent: kUsualCameraOffset_mm, 0 beside a covariance of the
  /// camera.
  std::optional<double> camera_offset_mm;
};

/// Returns inputs of which only the pixels are uncertain.
[[nodiscard]] InputUncertainty ExactInputs();

/// Inputs stated elsewhere, and thus excluded from the usual sizes.
struct OtherwiseStated {
  bool camera = false;   ///< true if a calibration covariance is given
  bool targets = false;  ///< true if a coordinate covariance is given
};

/// Replaces absent inputs by their usual sizes.
/// @param extent_mm  as of UsualTarget_mm
[[nodiscard]] InputUncertainty WithUsualSizes(const InputUncertainty& inputs,
                                              OtherwiseStated otherwise, double extent_mm);

/// Errors (kInput) name the field that is negative, not finite or beyond 1000.
[[nodiscard]] Result<void> Validate(const InputUncertainty& inputs);

}  // namespace trammel::part_alignment

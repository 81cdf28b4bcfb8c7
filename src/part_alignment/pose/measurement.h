// A measurement of a part: its targets, the pictures of them, and the uncertainty of its inputs.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

/// A target on the part, where the ideal part has it.
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

/// One picture, taken from a place of the spindle in machine coordinates: d_cnc and R_cnc.
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

/// How the camera sits in the spindle:
/// x_spindle = Rz(-angle) · Rx(tilt.x) · Ry(tilt.y) · x_taper + (eccentricity, 0).
struct Clamping {
  double angle_rad = 0;  ///< gamma_s; note the sign: the taper is turned by -gamma_s
  Eigen::Vector2d eccentricity_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
};

/// The whole chain: a point of the part in the camera's frame (mm),
/// U = R_cal^T [ R_s^T ( R_cnc^T (R_p X + d_p - d_cnc) - eccentricity ) - d_cal ].
[[nodiscard]] Eigen::Vector3d CameraFromPart(const Camera& camera, const Clamping& clamping,
                                             const View& view,
                                             const geometry::Pose& machine_from_part,
                                             const Eigen::Vector3d& part_mm);

/// Standard uncertainty of a camera's centre against the spindle's axis, X and Y each, where none
/// is stated: Table 3 of Mendikute et al. (X and Y repeat to 0.030 mm, k = 2, whatever the pictures
/// tell) needs 0.015 mm from clamping to clamping, and the clamping in which the camera was
/// calibrated is off as much, so the root of two of it; and as much more, the root of 9/7, as ten
/// repeats leave a standard deviation unknown (that of Student's t with nine degrees of freedom,
/// GUM supplement 1, 6.4.9). What a tilt of the taper moves at the targets' distance is in it.
constexpr double kUsualEccentricity_mm = 0.024;
/// Repeatability of each axis of a machine where none is stated: what Table 3's Z and angles leave
/// room for (0.0028 … 0.0037 mm).
constexpr double kUsualRepeatability_mm = 0.004;
/// Of the camera's place in its taper, X, Y and Z each, where its file brings no covariance: what
/// probing the taper, or touching a mark on the machine, leaves.
constexpr double kUsualCameraOffset_mm = 0.010;
/// Of each coordinate of a target where neither size nor covariance is stated: a length between
/// targets is wrong by up to 50 µm + 20 µm/m, as is typical of portable photogrammetry (Luhmann et
/// al. 2011, the budget's default), rectangular; each of its ends has a root of two less.
/// @param extent_mm  the diagonal of the box about all targets
[[nodiscard]] double UsualTarget_mm(double extent_mm);

/// Standard uncertainties (k = 1) of what goes into a measurement beside the pixels' own sigmas;
/// all normal, 0: exact. What is absent counts with its usual size, never as 0.
struct InputUncertainty {
  /// Each axis of each view's spindle position, independent. Absent: kUsualRepeatability_mm, and
  /// what the residuals tell of it (repeatability.h).
  std::optional<double> machine_mm;
  /// Each coordinate of each target, the same in all views. Absent: UsualTarget_mm, or more where
  /// the residuals ask for it (target_errors.h); 0 beside a covariance of the targets.
  std::optional<double> target_mm;
  // One value for the whole measurement; counts only where it is not among the unknowns.
  double clamp_angle_rad = 0;
  std::optional<double> clamp_eccentricity_mm;  ///< X and Y each; absent: kUsualEccentricity_mm
  double clamp_tilt_rad = 0;                    ///< about X and Y each
  double focal_length_mm = 0;
  /// X, Y and Z each; absent: kUsualCameraOffset_mm, 0 beside a covariance of the camera.
  std::optional<double> camera_offset_mm;
};

/// Pixels alone: nothing else is uncertain.
[[nodiscard]] InputUncertainty ExactInputs();

/// What is stated elsewhere, and so is in no usual size.
struct OtherwiseStated {
  bool camera = false;   ///< by a covariance of its calibration
  bool targets = false;  ///< by a covariance of their coordinates
};

/// With the usual sizes in place of what is absent.
/// @param extent_mm  as of UsualTarget_mm
[[nodiscard]] InputUncertainty WithUsualSizes(const InputUncertainty& inputs,
                                              OtherwiseStated otherwise, double extent_mm);

/// Errors (kInput) name the field that is negative, not finite or beyond 1000.
[[nodiscard]] Result<void> Validate(const InputUncertainty& inputs);

}  // namespace trammel::part_alignment

// What was seen of a part, from where.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

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

}  // namespace trammel::part_alignment

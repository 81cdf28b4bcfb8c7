// Computes the first guess of a calibration by the direct linear transform.
#pragma once

#include <Eigen/Core>
#include <span>

#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

enum class StartFault {
  kNone,
  kFlat,      ///< the places lie in one plane
  kMirrored,  ///< no proper rotation sees them from the stated side: the other side does
};

struct CameraStart {
  StartFault fault = StartFault::kNone;
  Camera camera;           ///< no distortion
  double flatness_mm = 0;  ///< root mean square distance of the places from their plane
};

/// Computes a pin-hole's eleven numbers from places (taper frame, mm) and pixels, after Abdel-Aziz
/// & Karara 1971, in Hartley's scaling. REQUIRES as many places as pixels, at least 6, finite.
[[nodiscard]] CameraStart StartCamera(const Camera& frame,
                                      std::span<const Eigen::Vector3d> taper_mm,
                                      std::span<const Eigen::Vector2d> pixels);

/// Parts of the left 3 × 3 of a pin-hole's matrix, its third row of length 1.
struct PinholeParts {
  Eigen::Vector2d principal = Eigen::Vector2d::Zero();
  double across = 0;  ///< focal lengths along columns and rows
  double down = 0;
  bool mirrored = false;  ///< no proper rotation has these rows; the rotation means nothing
  Eigen::Matrix3d camera_from_object = Eigen::Matrix3d::Identity();
};
[[nodiscard]] PinholeParts PartsOf(const Eigen::Matrix3d& pinhole);

}  // namespace trammel::part_alignment

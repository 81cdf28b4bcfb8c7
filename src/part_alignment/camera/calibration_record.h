// What a camera file says of how its camera was calibrated.
#pragma once

#include <optional>
#include <string>

#include "part_alignment/camera/camera_parameters.h"

namespace trammel::part_alignment {

struct CalibrationRecord {
  std::string date;       ///< YYYY-MM-DD
  double nearest_mm = 0;  ///< from the camera's origin along its axis: what it was fitted to
  double farthest_mm = 0;
  /// k = 1, in the order of kCameraParameterNames; absent: the camera counts as exact.
  std::optional<CameraCovariance> covariance = std::nullopt;
};

}  // namespace trammel::part_alignment

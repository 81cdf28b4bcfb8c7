// Record of a camera calibration, its age, and its uncertainty over the sensor.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

struct CalibrationRecord {
  std::string date;       ///< YYYY-MM-DD
  double nearest_mm = 0;  ///< fitted range, from the camera's origin along its axis
  double farthest_mm = 0;
  /// Covariance, k = 1, in the order of kCameraParameterNames; absent: the camera counts as exact.
  std::optional<CameraCovariance> covariance = std::nullopt;
};

/// Maximum age of a calibration: measuring instruments are commonly recalibrated after a year. A
/// camera that was dropped, heated or refocused since does not report it.
inline constexpr int kMaxCalibrationAgeDays = 365;

/// Returns a notice if `date` is more than `most_days` before `today`, after it, or no date;
/// otherwise absent. Dates are YYYY-MM-DD.
[[nodiscard]] std::optional<std::string> NoticeOfAge(std::string_view date, std::string_view today,
                                                     int max_days = kMaxCalibrationAgeDays);

/// Uncertainty of a predicted pixel over the sensor, for points at one distance.
struct SensorUncertainty {
  int columns = 0;
  int rows = 0;
  double distance_mm = 0;
  /// Standard uncertainty along the worse direction, px, on a grid of shape (rows, columns),
  /// row-major, evenly over the sensor with its edges. NaN where the lens has no line of sight.
  std::vector<double> sigma_px;
};
/// REQUIRES columns, rows >= 2, distance_mm > 0.
[[nodiscard]] SensorUncertainty UncertaintyOverSensor(const Camera& camera,
                                                      const CameraCovariance& covariance,
                                                      double distance_mm, int columns, int rows);

}  // namespace trammel::part_alignment

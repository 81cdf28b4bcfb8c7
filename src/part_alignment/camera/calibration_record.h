// A camera calibration after the fact: its record, its age, its uncertainty over the sensor.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

struct CalibrationRecord {
  std::string date;       ///< YYYY-MM-DD
  double nearest_mm = 0;  ///< from the camera's origin along its axis: what it was fitted to
  double farthest_mm = 0;
  /// k = 1, in the order of kCameraParameterNames; absent: the camera counts as exact.
  std::optional<CameraCovariance> covariance = std::nullopt;
};

/// A camera that was dropped, heated or refocused since does not say so; a year
/// is what measuring instruments are commonly recalibrated after.
inline constexpr int kMostCalibrationAgeDays = 365;

/// What to say where `date` lies more than `most_days` before `today`, lies
/// behind it, or is no date; absent where all is well. Dates are YYYY-MM-DD.
[[nodiscard]] std::optional<std::string> NoticeOfAge(std::string_view date, std::string_view today,
                                                     int most_days = kMostCalibrationAgeDays);

/// How far off a pixel may be foretold, over the sensor, for points at one distance.
struct SensorUncertainty {
  int columns = 0;
  int rows = 0;
  double distance_mm = 0;
  /// Shape (rows, columns), row-major, evenly over the sensor with its edges: 1 σ along the worse
  /// direction, px. NaN where the lens has no line of sight.
  std::vector<double> sigma_px;
};
/// REQUIRES columns, rows >= 2, distance_mm > 0.
[[nodiscard]] SensorUncertainty UncertaintyOverSensor(const Camera& camera,
                                                      const CameraCovariance& covariance,
                                                      double distance_mm, int columns, int rows);

}  // namespace trammel::part_alignment

// What a calibration's uncertainty means: from its set-up, and for pixels.
#pragma once

#include <vector>

#include "part_alignment/camera/calibrate.h"
#include "part_alignment/camera/camera_parameters.h"

namespace trammel::part_alignment {

/// What the probed taper and the target's place on its tip add to the covariance of a calibration:
/// no view tells of either, both shift and turn the camera in its taper.
[[nodiscard]] CameraCovariance CovarianceOfSetUp(const GridMeasurement& grid, const Camera& camera);

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

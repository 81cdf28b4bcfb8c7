// Converts cameras of other conventions: OpenCV's, mrcal's, and the inverse direction of Brown's
// polynomial.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

/// Camera in the convention of OpenCV and mrcal: x right, y down, z forward, (0, 0) the centre of
/// the first pixel. With x = u / w, y = v / w, r² = x² + y²:
///   x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶) + 2 p1 x y + p2 (r² + 2 x²),
///   y' = y (…) / (…) + p1 (r² + 2 y²) + 2 p2 x y,   column = fx x' + cx,   row = fy y' + cy.
struct OpenCvCamera {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0;
  double fy_px = 0;
  double cx_px = 0;
  double cy_px = 0;
  double k1 = 0;
  double k2 = 0;
  double p1 = 0;
  double p2 = 0;
  double k3 = 0;
  double k4 = 0;
  double k5 = 0;
  double k6 = 0;
};

/// (column, row) in px of a point of the camera's frame. Absent behind the camera.
[[nodiscard]] std::optional<Eigen::Vector2d> ProjectOpenCv(const OpenCvCamera& camera,
                                                           const Eigen::Vector3d& camera_mm);

struct ConvertedCamera {
  Camera camera;
  /// Largest pixel difference of the two cameras for one line of sight, over the whole sensor.
  double largest_error_px = 0;
  double rms_error_px = 0;
};

struct ConvertOptions {
  CameraConvention convention = CameraConvention::kBrownIdealToDistorted;
  /// Maximum accepted error, px. A hundredth of a pixel is 1 µm at 300 mm with 2800 px of focal
  /// length.
  double max_error_px = 0.01;
};

/// Converts an OpenCV camera: exactly if k3 … k6 are 0 and fx = fy, in OpenCV's own direction; else
/// by a fit over the sensor. looks_along is +z, taper_from_camera none: such a camera has neither.
/// Errors (kInput): numbers that are not finite, pixels that are not square, a lens that folds
/// within the picture, an error beyond most_error_px.
[[nodiscard]] Result<ConvertedCamera> FromOpenCv(const OpenCvCamera& camera, double pixel_pitch_mm,
                                                 const ConvertOptions& options);

/// Converts the camera to the inverse polynomial: principal point, focal length and all
/// coefficients are fitted by least squares over the sensor. Pose and side do not change. Errors as
/// above.
[[nodiscard]] Result<ConvertedCamera> ConvertConvention(const Camera& camera,
                                                        const ConvertOptions& options);

/// Returns the camera in Table 1 of Mendikute et al. 2017, "Self-calibration technique for
/// on-machine spindle-mounted vision systems": DMK 23GP031, 2592 x 1944 px of 2.2 µm, f = 6.189 mm.
/// The angles are printed to 1 mrad; half of that is 0.15 mm at 300 mm. So it represents such a
/// camera, not theirs.
[[nodiscard]] Camera TableOneCamera();

}  // namespace trammel::part_alignment

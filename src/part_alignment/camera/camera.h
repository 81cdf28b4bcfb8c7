// Camera in the spindle: a pin-hole with Brown's distortion, clamped in a taper.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

#include "base/result.h"
#include "geometry/euler.h"

namespace trammel::part_alignment {

/// Direction of the distortion polynomial. The wrong one bends the picture by twice the distortion,
/// and no residual shows it.
enum class CameraConvention {
  /// Photogrammetry: ideal = m + m (k1 r² + k2 r⁴) + [p1 (r² + 2 x²) + 2 p2 x y,
  ///                                               p2 (r² + 2 y²) + 2 p1 x y],
  /// m = (x, y) the *measured* place about the principal point, r² = x² + y².
  kBrownMeasuredToIdeal,
  /// OpenCV: distorted = i + i (k1 r² + k2 r⁴) + [2 p1 x y + p2 (r² + 2 x²),
  ///                                             p1 (r² + 2 y²) + 2 p2 x y],
  /// i = (x, y) the *ideal* place about the principal point.
  kBrownIdealToDistorted,
};

/// Side of the camera frame's origin on which the visible scene is. Projection is u / w on both.
/// With w < 0 and rows that run down, the picture is the *mirror image* of the scene; only where
/// rows run up is it a turn by 180 degrees. A real sensor whose rows run down looks along +z, and
/// no rotation turns it into a camera that looks along -z.
enum class LooksAlong { kPlusZ, kMinusZ };

/// Pixel (0, 0) is the centre of the first pixel; columns run right, rows down. Distortion works in
/// pixels: k1, k2, p1, p2 are in px^-2, px^-4, px^-1, px^-1.
struct Camera {
  CameraConvention convention = CameraConvention::kBrownMeasuredToIdeal;
  int width_px = 0;
  int height_px = 0;
  double pixel_pitch_mm = 0;
  double focal_length_mm = 0;
  /// (column, row) of the principal point less the image's centre ((W - 1) / 2, (H - 1) / 2).
  Eigen::Vector2d principal_point_offset_px = Eigen::Vector2d::Zero();
  double k1 = 0;
  double k2 = 0;
  double p1 = 0;
  double p2 = 0;
  LooksAlong looks_along = LooksAlong::kMinusZ;
  /// x_taper = R(angles) x_camera + translation: R_calib and d_calib of the literature.
  geometry::Pose taper_from_camera;
};

/// Checks a camera. Errors (kInput) name the field, its value and the bounds.
[[nodiscard]] Result<void> Validate(const Camera& camera);

/// Returns the principal point, (column, row) in px.
[[nodiscard]] Eigen::Vector2d PrincipalPoint(const Camera& camera);

/// Returns the pixel (column, row) of a point of the camera frame (mm): principal point + focal
/// length / pitch · (u / w, v / w), then the lens. Absent behind the camera, and where the
/// distortion cannot be inverted (it folds there). May be outside the image. The inversion is exact
/// to 1e-12 px. REQUIRES Validate(camera), as all below.
[[nodiscard]] std::optional<Eigen::Vector2d> Project(const Camera& camera,
                                                     const Eigen::Vector3d& camera_mm);

/// Projection with its derivatives, px per mm.
struct Projection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;  ///< d(column, row) / d(u, v, w)
  Eigen::Vector2d by_focal_length;       ///< d(column, row) / d(focal length)
};
[[nodiscard]] std::optional<Projection> ProjectWithDerivative(const Camera& camera,
                                                              const Eigen::Vector3d& camera_mm);

/// Computes a pixel's line of sight: a unit vector in the camera frame, towards the visible side.
/// Absent where the distortion cannot be inverted.
[[nodiscard]] std::optional<Eigen::Vector3d> LineOfSight(const Camera& camera,
                                                         const Eigen::Vector2d& pixel);

inline constexpr int kIntrinsics = 7;
inline constexpr int kCameraParameters = 13;

/// Names of camera parameters, in the order of vectors and covariances, as in files and messages.
inline constexpr std::array<const char*, kCameraParameters> kCameraParameterNames{
    "focal_length_mm",
    "principal_column_px",
    "principal_row_px",
    "k1",
    "k2",
    "p1",
    "p2",
    "x_mm",
    "y_mm",
    "z_mm",
    "alpha_rad",
    "beta_rad",
    "gamma_rad"};

using CameraVector = Eigen::Matrix<double, kCameraParameters, 1>;
using CameraCovariance = Eigen::Matrix<double, kCameraParameters, kCameraParameters>;

/// Errors (kInput): a number that is not finite, a matrix that is not symmetric or has a negative
/// eigenvalue.
[[nodiscard]] Result<void> Validate(const CameraCovariance& covariance);

[[nodiscard]] CameraVector ParametersOf(const Camera& camera);
/// `frame` with its parameters replaced: size, pitch, convention and side stay.
[[nodiscard]] Camera WithParameters(const Camera& frame, const CameraVector& parameters);

struct ParameterProjection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_taper;  ///< px per mm of the point in the taper frame
  Eigen::Matrix<double, 2, kCameraParameters> by_parameter;
};

/// Returns the pixel of a point of the taper frame (mm), with all derivatives. Absent where Project
/// has no pixel.
[[nodiscard]] std::optional<ParameterProjection> ProjectFromTaper(const Camera& camera,
                                                                  const Eigen::Vector3d& taper_mm);

/// Returns the fault of a camera (field, value and bound): numbers that are not finite, impossible
/// sizes and lengths. Absent if it is sound.
[[nodiscard]] std::optional<std::string> FaultOf(const Camera& camera);

}  // namespace trammel::part_alignment

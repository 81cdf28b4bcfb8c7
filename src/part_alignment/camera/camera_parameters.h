// The camera's parameters as a vector, and what each does to a pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

#include "base/result.h"
#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

inline constexpr int kIntrinsics = 7;
inline constexpr int kCameraParameters = 13;

/// In the order of every vector and covariance of a calibration, as files and messages call them.
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

/// Where a point of the taper frame (mm) appears, with all derivatives. Absent where Project has no
/// pixel.
[[nodiscard]] std::optional<ParameterProjection> ProjectFromTaper(const Camera& camera,
                                                                  const Eigen::Vector3d& taper_mm);

/// What is wrong with a camera (the field, its value and the bound): numbers that are not finite,
/// sizes and lengths that no camera has. Absent where it is sound.
[[nodiscard]] std::optional<std::string> FaultOf(const Camera& camera);

}  // namespace trammel::part_alignment

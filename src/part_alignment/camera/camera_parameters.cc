#include "part_alignment/camera/camera_parameters.h"

#include <fmt/format.h>

#include <cmath>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// What k1, k2, p1 and p2 add to a place about the principal point, each by itself.
Eigen::Matrix<double, 2, 4> DistortionBasis(CameraConvention convention, const Vector2d& at) {
  const double x = at.x();
  const double y = at.y();
  const double r2 = at.squaredNorm();
  const Vector2d along_x(r2 + 2 * x * x, 2 * x * y);
  const Vector2d along_y(2 * x * y, r2 + 2 * y * y);
  const bool photogrammetry = convention == CameraConvention::kBrownMeasuredToIdeal;
  Eigen::Matrix<double, 2, 4> basis;
  basis << at * r2, at * r2 * r2, photogrammetry ? along_x : along_y,
      photogrammetry ? along_y : along_x;
  return basis;
}

}  // namespace

Result<void> Validate(const CameraCovariance& covariance) {
  // Written with 17 digits, and of a positive definite matrix that may be all but singular.
  constexpr double kAlike = 1e-9;
  const CameraVector variances = covariance.diagonal();
  if (!covariance.allFinite() || (variances.array() < 0).any()) {
    return Fail("the camera's covariance has a number that is not finite, or a negative variance");
  }
  // Parameters of very different sizes: the eigenvalues are judged of their correlations. One
  // without variance that others vary with makes one negative, too.
  const CameraVector sigmas = variances.cwiseSqrt();
  const CameraVector scale = (sigmas.array() > 0).select(sigmas.cwiseInverse(), 1);
  const Eigen::MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  if (!correlation.isApprox(correlation.transpose(), kAlike) ||
      geometry::SymmetricEigenvalues(correlation).minCoeff() < -kAlike) {
    return Fail("the camera's covariance is none: not symmetric, or with a negative eigenvalue");
  }
  return {};
}

CameraVector ParametersOf(const Camera& camera) {
  CameraVector p;
  p << camera.focal_length_mm, camera.principal_point_offset_px, camera.k1, camera.k2, camera.p1,
      camera.p2, camera.taper_from_camera.translation_mm, camera.taper_from_camera.angles_rad;
  return p;
}

Camera WithParameters(const Camera& frame, const CameraVector& parameters) {
  Camera camera = frame;
  camera.focal_length_mm = parameters[0];
  camera.principal_point_offset_px = parameters.segment<2>(1);
  camera.k1 = parameters[3];
  camera.k2 = parameters[4];
  camera.p1 = parameters[5];
  camera.p2 = parameters[6];
  camera.taper_from_camera.translation_mm = parameters.segment<3>(7);
  camera.taper_from_camera.angles_rad = parameters.segment<3>(10);
  return camera;
}

std::optional<ParameterProjection> ProjectFromTaper(const Camera& camera,
                                                    const Vector3d& taper_mm) {
  const geometry::Pose& pose = camera.taper_from_camera;
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(pose.angles_rad);
  const Vector3d from_origin_mm = taper_mm - pose.translation_mm;
  const Vector3d camera_mm = rotation.transpose() * from_origin_mm;
  const auto projected = ProjectWithDerivative(camera, camera_mm);
  if (!projected) return std::nullopt;
  const double focal_px = camera.focal_length_mm / camera.pixel_pitch_mm;
  const Vector2d slope = camera_mm.head<2>() / camera_mm.z();
  // by_point = by_ideal · focal_px / w · [1 0 -slope.x; 0 1 -slope.y]
  const Matrix2d by_ideal = projected->by_point.leftCols<2>() * (camera_mm.z() / focal_px);
  ParameterProjection result;
  result.pixel = projected->pixel;
  result.by_taper = projected->by_point * rotation.transpose();
  result.by_parameter.col(0) = by_ideal * slope / camera.pixel_pitch_mm;
  result.by_parameter.middleCols<2>(1).setIdentity();
  if (camera.convention == CameraConvention::kBrownMeasuredToIdeal) {
    // ideal = m + basis(m) k does not move with k, so m moves against it.
    const Vector2d measured = projected->pixel - PrincipalPoint(camera);
    result.by_parameter.middleCols<4>(3) = -by_ideal * DistortionBasis(camera.convention, measured);
  } else {
    result.by_parameter.middleCols<4>(3) = DistortionBasis(camera.convention, focal_px * slope);
  }
  result.by_parameter.middleCols<3>(7) = -result.by_taper;
  for (int i = 0; i < 3; ++i) {
    result.by_parameter.col(10 + i) =
        projected->by_point *
        (geometry::RotationDerivative(pose.angles_rad, i).transpose() * from_origin_mm);
  }
  return result;
}

std::optional<std::string> FaultOf(const Camera& camera) {
  constexpr int kLeastPx = 16;
  constexpr int kMostPx = 100'000;
  if (camera.width_px < kLeastPx || camera.width_px > kMostPx || camera.height_px < kLeastPx ||
      camera.height_px > kMostPx) {
    return fmt::format("the image is {} x {} px; it must be {} … {} px each way", camera.width_px,
                       camera.height_px, kLeastPx, kMostPx);
  }
  constexpr double kLeastPitch_mm = 1e-4;
  constexpr double kMostPitch_mm = 1;
  if (!(camera.pixel_pitch_mm >= kLeastPitch_mm && camera.pixel_pitch_mm <= kMostPitch_mm)) {
    return fmt::format("the pixel pitch is {} mm; it must be {} … {} mm", camera.pixel_pitch_mm,
                       kLeastPitch_mm, kMostPitch_mm);
  }
  constexpr double kMostFocal_mm = 10'000;
  if (!(camera.focal_length_mm > 0 && camera.focal_length_mm <= kMostFocal_mm)) {
    return fmt::format("the focal length is {} mm; it must be above 0 and at most {} mm",
                       camera.focal_length_mm, kMostFocal_mm);
  }
  const CameraVector parameters = ParametersOf(camera);
  for (int i = 0; i < kCameraParameters; ++i) {
    if (!std::isfinite(parameters[i])) {
      return fmt::format("{} of the camera is not a finite number",
                         kCameraParameterNames[static_cast<std::size_t>(i)]);
    }
  }
  return std::nullopt;
}

}  // namespace trammel::part_alignment

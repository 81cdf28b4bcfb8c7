#include "part_alignment/camera/camera.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Limit beyond which there is no picture, and numbers lose their meaning; also excludes infinities
/// and NaN.
constexpr double kFarthest_px = 1e8;

/// Brown's polynomial at a place about the principal point, and its derivative.
struct Bent {
  Vector2d place;
  Matrix2d by_place;
};

Bent Bend(const Camera& camera, const Vector2d& place) {
  // Both conventions are one polynomial after reordering the tangential coefficients: along_x (r² +
  // 2 x²) + 2 along_y x y, and along_y (r² + 2 y²) + 2 along_x x y.
  const bool paper = camera.convention == CameraConvention::kBrownMeasuredToIdeal;
  const double along_x = paper ? camera.p1 : camera.p2;
  const double along_y = paper ? camera.p2 : camera.p1;
  const double x = place.x();
  const double y = place.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (camera.k1 + r2 * camera.k2);
  const double radial_by_r2 = camera.k1 + 2 * r2 * camera.k2;
  Bent bent;
  bent.place = {x * radial + along_x * (r2 + 2 * x * x) + 2 * along_y * x * y,
                y * radial + along_y * (r2 + 2 * y * y) + 2 * along_x * x * y};
  const double mixed = 2 * x * y * radial_by_r2 + 2 * along_x * y + 2 * along_y * x;
  bent.by_place << radial + 2 * x * x * radial_by_r2 + 6 * along_x * x + 2 * along_y * y, mixed,
      mixed, radial + 2 * y * y * radial_by_r2 + 6 * along_y * y + 2 * along_x * x;
  return bent;
}

/// Computes the squared radius at which r (1 + k1 r² + k2 r⁴) turns back: beyond it a second
/// picture overlaps the first.
double FoldRadius2(const Camera& camera) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const double half = 1.5 * camera.k1;
  const double root2 = half * half - 5 * camera.k2;
  if (root2 < 0) {
    return kNever;
  }
  // 1 + 2 half s + 5 k2 s² = 0, solved for 1 / s, which needs no division by a vanishing k2.
  const double inverse = -half + std::sqrt(root2);
  return inverse > 0 ? 1 / inverse : kNever;
}

/// True if the polynomial is still one to one at this position.
bool Unfolded(const Bent& bent, double r2, double fold2) {
  return r2 < fold2 && bent.by_place(0, 0) > 0 && bent.by_place.determinant() > 0;
}

/// Finds the place that Bend maps to `bent`, by Newton steps that are halved until they help.
std::optional<Vector2d> Unbend(const Camera& camera, const Vector2d& wanted) {
  if (!(wanted.norm() < kFarthest_px)) {
    return std::nullopt;
  }
  constexpr int kSteps = 60;
  constexpr int kHalvings = 40;
  constexpr double kTolerance_px = 1e-12;
  const double fold2 = FoldRadius2(camera);
  Vector2d place = wanted;
  if (place.squaredNorm() >= fold2) {
    place *= 0.9 * std::sqrt(fold2) / place.norm();
  }
  Bent bent = Bend(camera, place);
  for (int i = 0; !Unfolded(bent, place.squaredNorm(), fold2); ++i) {
    if (i == kHalvings) {
      return std::nullopt;
    }
    place /= 2;
    bent = Bend(camera, place);
  }
  const double rounding_px = 8 * std::numeric_limits<double>::epsilon() * (1 + wanted.norm());
  for (int i = 0; i < kSteps; ++i) {
    const Vector2d error = wanted - bent.place;
    Vector2d step = bent.by_place.inverse() * error;
    if (step.norm() <= std::max(kTolerance_px / 10, rounding_px / 8)) {
      return place + step;
    }
    bool better = false;
    for (int halving = 0; halving < kHalvings && !better; ++halving, step /= 2) {
      const Vector2d next = place + step;
      const Bent there = Bend(camera, next);
      better = Unfolded(there, next.squaredNorm(), fold2) &&
               (wanted - there.place).norm() < error.norm();
      if (better) {
        place = next;
        bent = there;
        break;
      }
    }
    if (!better) {
      return error.norm() <= rounding_px ? std::optional(place) : std::nullopt;
    }
  }
  return std::nullopt;
}

Result<void> CheckRange(std::string_view name, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    return Fail(fmt::format("camera: {} is {}, it must lie in {} ... {}", name, value, low, high));
  }
  return {};
}

}  // namespace

Result<void> Validate(const Camera& camera) {
  constexpr double kMaxPixels = 100000;
  constexpr double kFarthest_mm = 1e5;
  struct Field {
    std::string_view name;
    double value;
    double low;
    double high;
  };
  // Ranges of real cameras: an error of unit is outside, an unusual camera is not.
  const geometry::Pose& taper = camera.taper_from_camera;
  const std::array fields{
      Field{"image_px[0] (width)", double(camera.width_px), 2, kMaxPixels},
      Field{"image_px[1] (height)", double(camera.height_px), 2, kMaxPixels},
      Field{"pixel_pitch_mm", camera.pixel_pitch_mm, 1e-5, 1},
      Field{"focal_length_mm", camera.focal_length_mm, 1e-2, 1e4},
      Field{"principal_point_offset_px[0]", camera.principal_point_offset_px.x(),
            -0.5 * camera.width_px, 0.5 * camera.width_px},
      Field{"principal_point_offset_px[1]", camera.principal_point_offset_px.y(),
            -0.5 * camera.height_px, 0.5 * camera.height_px},
      Field{"k1", camera.k1, -1e-3, 1e-3},
      Field{"k2", camera.k2, -1e-6, 1e-6},
      Field{"p1", camera.p1, -1e-2, 1e-2},
      Field{"p2", camera.p2, -1e-2, 1e-2},
      Field{"taper_from_camera.translation_mm[0]", taper.translation_mm.x(), -kFarthest_mm,
            kFarthest_mm},
      Field{"taper_from_camera.translation_mm[1]", taper.translation_mm.y(), -kFarthest_mm,
            kFarthest_mm},
      Field{"taper_from_camera.translation_mm[2]", taper.translation_mm.z(), -kFarthest_mm,
            kFarthest_mm},
      Field{"taper_from_camera.angles_rad[0]", taper.angles_rad.x(), -7, 7},
      Field{"taper_from_camera.angles_rad[1]", taper.angles_rad.y(), -7, 7},
      Field{"taper_from_camera.angles_rad[2]", taper.angles_rad.z(), -7, 7}};
  for (const Field& field : fields) {
    TRY(CheckRange(field.name, field.value, field.low, field.high));
  }
  return {};
}

Vector2d PrincipalPoint(const Camera& camera) {
  return Vector2d(0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)) +
         camera.principal_point_offset_px;
}

std::optional<Projection> ProjectWithDerivative(const Camera& camera, const Vector3d& camera_mm) {
  const double w = camera_mm.z();
  const bool visible = camera.looks_along == LooksAlong::kPlusZ ? w > 0 : w < 0;
  if (!visible) {
    return std::nullopt;
  }
  const double focal_px = camera.focal_length_mm / camera.pixel_pitch_mm;
  const Vector2d slope = camera_mm.head<2>() / w;
  const Vector2d ideal_px = focal_px * slope;
  if (!(ideal_px.norm() < kFarthest_px)) {
    return std::nullopt;
  }
  Eigen::Matrix<double, 2, 3> ideal_by_point;
  ideal_by_point << focal_px / w, 0, -ideal_px.x() / w, 0, focal_px / w, -ideal_px.y() / w;

  Vector2d place;
  Matrix2d place_by_ideal;
  if (camera.convention == CameraConvention::kBrownIdealToDistorted) {
    const Bent bent = Bend(camera, ideal_px);
    if (!Unfolded(bent, ideal_px.squaredNorm(), FoldRadius2(camera))) {
      return std::nullopt;
    }
    place = bent.place;
    place_by_ideal = bent.by_place;
  } else {
    const std::optional<Vector2d> measured = Unbend(camera, ideal_px);
    if (!measured) {
      return std::nullopt;
    }
    place = *measured;
    place_by_ideal = Bend(camera, place).by_place.inverse();
  }
  return Projection{PrincipalPoint(camera) + place, place_by_ideal * ideal_by_point,
                    place_by_ideal * slope / camera.pixel_pitch_mm};
}

std::optional<Vector2d> Project(const Camera& camera, const Vector3d& camera_mm) {
  const std::optional<Projection> projection = ProjectWithDerivative(camera, camera_mm);
  return projection ? std::optional(projection->pixel) : std::nullopt;
}

std::optional<Vector3d> LineOfSight(const Camera& camera, const Vector2d& pixel) {
  const Vector2d place = pixel - PrincipalPoint(camera);
  if (!(place.norm() < kFarthest_px)) {
    return std::nullopt;
  }
  Vector2d ideal_px;
  if (camera.convention == CameraConvention::kBrownIdealToDistorted) {
    const std::optional<Vector2d> unbent = Unbend(camera, place);
    if (!unbent) {
      return std::nullopt;
    }
    ideal_px = *unbent;
  } else {
    const Bent bent = Bend(camera, place);
    if (!Unfolded(bent, place.squaredNorm(), FoldRadius2(camera))) {
      return std::nullopt;
    }
    ideal_px = bent.place;
  }
  const Vector2d slope = ideal_px * camera.pixel_pitch_mm / camera.focal_length_mm;
  const double side = camera.looks_along == LooksAlong::kPlusZ ? 1 : -1;
  return (side * Vector3d(slope.x(), slope.y(), 1)).normalized();
}

namespace {

// Computes the separate shifts by k1, k2, p1 and p2 of a position about the principal point.
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
  // Parameters differ much in size, so the eigenvalues of their correlations are checked. A
  // parameter without variance that others covary with makes one negative, too.
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
  constexpr int kMinPx = 16;
  constexpr int kMaxPx = 100'000;
  if (camera.width_px < kMinPx || camera.width_px > kMaxPx || camera.height_px < kMinPx ||
      camera.height_px > kMaxPx) {
    return fmt::format("the image is {} x {} px; it must be {} … {} px each way", camera.width_px,
                       camera.height_px, kMinPx, kMaxPx);
  }
  constexpr double kMinPitch_mm = 1e-4;
  constexpr double kMaxPitch_mm = 1;
  if (!(camera.pixel_pitch_mm >= kMinPitch_mm && camera.pixel_pitch_mm <= kMaxPitch_mm)) {
    return fmt::format("the pixel pitch is {} mm; it must be {} … {} mm", camera.pixel_pitch_mm,
                       kMinPitch_mm, kMaxPitch_mm);
  }
  constexpr double kMaxFocal_mm = 10'000;
  if (!(camera.focal_length_mm > 0 && camera.focal_length_mm <= kMaxFocal_mm)) {
    return fmt::format("the focal length is {} mm; it must be above 0 and at most {} mm",
                       camera.focal_length_mm, kMaxFocal_mm);
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

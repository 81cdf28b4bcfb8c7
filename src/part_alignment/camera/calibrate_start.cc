#include "part_alignment/camera/calibrate_start.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "base/check.h"
#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

using Pinhole = Eigen::Matrix<double, 3, 4>;

// Moves and scales points so that their mean is 0 and their distance from it about 1.
template <int N>
struct Scaling {
  Eigen::Matrix<double, N, 1> mean = Eigen::Matrix<double, N, 1>::Zero();
  double size = 0;

  explicit Scaling(std::span<const Eigen::Matrix<double, N, 1>> points) {
    const auto count = static_cast<double>(points.size());
    for (const auto& point : points) mean += point / count;
    for (const auto& point : points) size += (point - mean).squaredNorm() / (N * count);
    size = std::sqrt(size);
  }
  [[nodiscard]] Eigen::Matrix<double, N, 1> operator()(
      const Eigen::Matrix<double, N, 1>& point) const {
    return (point - mean) / size;
  }
};

Pinhole SolvePinhole(std::span<const Vector3d> places, std::span<const Vector2d> pixels) {
  const Scaling<3> place(places);
  const Scaling<2> pixel(pixels);
  Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector4d x = place(places[i]).homogeneous();
    const Vector2d q = pixel(pixels[i]);
    Eigen::Matrix<double, 2, 12> rows = Eigen::Matrix<double, 2, 12>::Zero();
    rows.row(0).segment<4>(0) = x.transpose();
    rows.row(0).segment<4>(8) = -q.x() * x.transpose();
    rows.row(1).segment<4>(4) = x.transpose();
    rows.row(1).segment<4>(8) = -q.y() * x.transpose();
    normal += rows.transpose() * rows;
  }
  const Eigen::Matrix<double, 12, 1> p = geometry::DecomposeSymmetric(normal).vectors.col(0);
  Pinhole scaled;
  scaled << p.segment<4>(0).transpose(), p.segment<4>(4).transpose(), p.segment<4>(8).transpose();
  Eigen::Matrix4d from_places = Eigen::Matrix4d::Identity();
  from_places.topLeftCorner<3, 3>() /= place.size;
  from_places.topRightCorner<3, 1>() = -place.mean / place.size;
  Matrix3d to_pixels = Matrix3d::Identity();
  to_pixels.topLeftCorner<2, 2>() *= pixel.size;
  to_pixels.topRightCorner<2, 1>() = pixel.mean;
  return to_pixels * scaled * from_places;
}

double Flatness(std::span<const Vector3d> places) {
  const Scaling<3> scaling(places);
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& place : places) {
    spread += (place - scaling.mean) * (place - scaling.mean).transpose();
  }
  const double least = geometry::SymmetricEigenvalues(spread)[0];
  return std::sqrt(std::max(0.0, least) / static_cast<double>(places.size()));
}

}  // namespace

PinholeParts PartsOf(const Matrix3d& pinhole) {
  const Vector3d axis = pinhole.row(2);
  PinholeParts parts;
  parts.principal = {pinhole.row(0).dot(axis), pinhole.row(1).dot(axis)};
  const Vector3d across = pinhole.row(0).transpose() - parts.principal.x() * axis;
  const Vector3d down = pinhole.row(1).transpose() - parts.principal.y() * axis;
  parts.across = across.norm();
  parts.down = down.norm();
  Matrix3d rows;
  rows << across.transpose().normalized(), down.transpose().normalized(), axis.transpose();
  parts.mirrored = rows.determinant() < 0;
  const geometry::SingularValues nearly = geometry::DecomposeSingular(rows);
  parts.camera_from_object = nearly.u * nearly.v.transpose();
  return parts;
}

CameraStart StartCamera(const Camera& frame, std::span<const Vector3d> taper_mm,
                        std::span<const Vector2d> pixels) {
  TRAMMEL_CHECK(taper_mm.size() == pixels.size() && taper_mm.size() >= 6, "{} places, {} pixels",
                taper_mm.size(), pixels.size());
  CameraStart start;
  start.camera = frame;
  start.flatness_mm = Flatness(taper_mm);
  const Scaling<3> scaling(taper_mm);
  constexpr double kFlat = 1e-3;  // relative to the points' extent: linear start needs depth
  if (!(start.flatness_mm > kFlat * scaling.size)) {
    start.fault = StartFault::kFlat;
    return start;
  }
  Pinhole p = SolvePinhole(taper_mm, pixels);
  p /= p.row(2).head<3>().norm();
  const double side = frame.looks_along == LooksAlong::kPlusZ ? 1 : -1;
  if (side * (p.row(2) * scaling.mean.homogeneous()).value() < 0) p = -p;
  const PinholeParts parts = PartsOf(p.leftCols<3>());
  if (parts.mirrored) {
    // Noise alone may turn the sign where positions are shallow.
    constexpr double kShallow = 0.05;
    const bool shallow = start.flatness_mm < kShallow * scaling.size;
    start.fault = shallow ? StartFault::kFlat : StartFault::kMirrored;
    return start;
  }
  Camera& camera = start.camera;
  camera.focal_length_mm = camera.pixel_pitch_mm * (parts.across + parts.down) / 2;
  camera.principal_point_offset_px =
      parts.principal - Vector2d((camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0);
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = 0;
  camera.taper_from_camera.angles_rad =
      geometry::AnglesFromRotation(parts.camera_from_object.transpose());
  // The camera's centre is where the pin-hole's three rows vanish.
  camera.taper_from_camera.translation_mm = -p.leftCols<3>().inverse() * p.col(3);
  return start;
}

}  // namespace trammel::part_alignment

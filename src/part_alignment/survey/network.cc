#include "part_alignment/survey/network.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace trammel::part_alignment {
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kSteepest = 5.7;  // tan of 80 degrees

struct Bent {
  Vector2d place;
  Matrix2d by_place;
};

Bent Bend(const Lens& lens, const Vector2d& slope) {
  const double x = slope.x();
  const double y = slope.y();
  const double r2 = slope.squaredNorm();
  const double radial = 1 + r2 * (lens[kK1] + r2 * (lens[kK2] + r2 * lens[kK3]));
  const double by_r2 = lens[kK1] + r2 * (2 * lens[kK2] + 3 * r2 * lens[kK3]);
  const double p1 = lens[kP1];
  const double p2 = lens[kP2];
  Bent bent;
  bent.place = radial * slope + Vector2d(2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                                         p1 * (r2 + 2 * y * y) + 2 * p2 * x * y);
  bent.by_place = radial * Matrix2d::Identity() + 2 * by_r2 * slope * slope.transpose();
  bent.by_place(0, 0) += 2 * p1 * y + 6 * p2 * x;
  bent.by_place(0, 1) += 2 * p1 * x + 2 * p2 * y;
  bent.by_place(1, 0) += 2 * p1 * x + 2 * p2 * y;
  bent.by_place(1, 1) += 6 * p1 * y + 2 * p2 * x;
  return bent;
}

}  // namespace

Lens PlainLens(double focal_px, int width_px, int height_px) {
  Lens lens = Lens::Zero();
  lens[kFocal] = focal_px;
  lens[kColumn] = 0.5 * (width_px - 1);
  lens[kRow] = 0.5 * (height_px - 1);
  return lens;
}

std::optional<LensProjection> ProjectLens(const Lens& lens, const Vector3d& camera) {
  const double w = camera.z();
  if (!(w > 0)) return std::nullopt;
  const Vector2d slope = camera.head<2>() / w;
  const double r2 = slope.squaredNorm();
  if (!(r2 < kSteepest * kSteepest)) return std::nullopt;
  const Bent bent = Bend(lens, slope);
  const double focal = lens[kFocal];
  LensProjection projection;
  projection.pixel = Vector2d(lens[kColumn], lens[kRow]) + focal * bent.place;
  Eigen::Matrix<double, 2, 3> slope_by_point;
  slope_by_point << 1 / w, 0, -slope.x() / w, 0, 1 / w, -slope.y() / w;
  projection.by_point = focal * bent.by_place * slope_by_point;
  const double x = slope.x();
  const double y = slope.y();
  projection.by_lens.col(kFocal) = bent.place;
  projection.by_lens.col(kColumn) = Vector2d::UnitX();
  projection.by_lens.col(kRow) = Vector2d::UnitY();
  projection.by_lens.col(kK1) = focal * r2 * slope;
  projection.by_lens.col(kK2) = focal * r2 * r2 * slope;
  projection.by_lens.col(kK3) = focal * r2 * r2 * r2 * slope;
  projection.by_lens.col(kP1) = focal * Vector2d(2 * x * y, r2 + 2 * y * y);
  projection.by_lens.col(kP2) = focal * Vector2d(r2 + 2 * x * x, 2 * x * y);
  return projection;
}

std::optional<Vector3d> ObservationLine(const Lens& lens, const Vector2d& pixel) {
  const Vector2d place = (pixel - Vector2d(lens[kColumn], lens[kRow])) / lens[kFocal];
  Vector2d slope = place;
  constexpr int kMaxSteps = 50;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Bent bent = Bend(lens, slope);
    if (!(bent.by_place.determinant() > 0)) return std::nullopt;  // folded
    const Vector2d change = bent.by_place.inverse() * (place - bent.place);
    slope += change;
    if (!(slope.norm() < kSteepest)) return std::nullopt;
    if (change.norm() < 1e-13) return Vector3d(slope.x(), slope.y(), 1).normalized();
  }
  return std::nullopt;
}

bool TakesPart(const Network& network, const NetworkObservation& observation) {
  return observation.used && network.stations[observation.station].placed &&
         network.points[observation.point].placed;
}

bool TakesPart(const Network& network, const NetworkBar& bar) {
  return bar.used && network.points[bar.from].placed && network.points[bar.to].placed;
}

std::optional<Eigen::Vector2d> Misclosure(const Network& network,
                                          const NetworkObservation& observation) {
  const auto projection = ProjectLens(
      network.lens,
      network.stations[observation.station].FromObject(network.points[observation.point].at));
  if (!projection) return std::nullopt;
  return projection->pixel - observation.pixel;
}

std::optional<Eigen::Vector3d> Intersect(const std::vector<Eigen::Vector3d>& places,
                                         const std::vector<Eigen::Vector3d>& directions) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - directions[i] * directions[i].transpose();
    normal += across;
    right += across * places[i];
  }
  constexpr double kParallel = 1e-6;  // about 0.06 degrees between two lines
  const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
  if (places.size() < 2 || factor.vectorD().minCoeff() < kParallel) return std::nullopt;
  return factor.solve(right);
}

void Transform(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& origin, double scale,
               Network& network) {
  for (Station& station : network.stations) {
    station.place = scale * (rotation * (station.place - origin));
    station.rotation = station.rotation * rotation.transpose();
  }
  for (NetworkPoint& point : network.points) point.at = scale * (rotation * (point.at - origin));
}

}  // namespace trammel::part_alignment

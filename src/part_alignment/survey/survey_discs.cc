#include "part_alignment/survey/survey_discs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/camera/camera.h"
#include "part_alignment/targets/eccentricity.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Converts the lens to a camera at its own place; the effect of k3 on an eccentricity is
// negligible.
Camera CameraOf(const Lens& lens) {
  constexpr double kPitch_mm = 1e-3;
  const double focal = lens[kFocal];
  Camera camera;
  camera.convention = CameraConvention::kBrownIdealToDistorted;
  camera.looks_along = LooksAlong::kPlusZ;
  camera.width_px = 2;  // only differences of places are asked for
  camera.height_px = 2;
  camera.pixel_pitch_mm = kPitch_mm;
  camera.focal_length_mm = focal * kPitch_mm;
  camera.k1 = lens[kK1] / (focal * focal);
  camera.k2 = lens[kK2] / std::pow(focal, 4);
  camera.p1 = lens[kP1] / focal;
  camera.p2 = lens[kP2] / focal;
  return camera;
}

// Returns the rows of (J P J^T) by the six numbers of P, in units of the disc's size.
Eigen::Matrix<double, 3, 6> MomentsByP(const Eigen::Matrix<double, 2, 3>& j) {
  constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  Eigen::Matrix<double, 3, 6> rows;
  for (int k = 0; k < 6; ++k) {
    const int a = kPairs[k][0];
    const int b = kPairs[k][1];
    const Matrix2d both =
        a == b ? Matrix2d(j.col(a) * j.col(a).transpose())
               : Matrix2d(j.col(a) * j.col(b).transpose() + j.col(b) * j.col(a).transpose());
    rows.col(k) = Vector3d(both(0, 0), std::numbers::sqrt2 * both(0, 1), both(1, 1));
  }
  return rows;
}

std::optional<ObjectDisc> FitDisc(const Network& network,
                                  const std::vector<std::optional<ImageEllipse>>& discs,
                                  const std::vector<std::size_t>& observations) {
  std::vector<DiscShape> shapes;
  for (const std::size_t i : observations) {
    const NetworkObservation& observation = network.observations[i];
    if (!observation.used || !discs[i]) continue;
    const Station& station = network.stations[observation.station];
    const auto projection =
        ProjectLens(network.lens, station.FromObject(network.points[observation.point].at));
    if (projection)
      shapes.push_back({projection->by_point * station.rotation, MomentsOf(*discs[i])});
  }
  return DiscOf(shapes);
}

// Returns the maximum effect of perspective on a disc of this shape, px.
double MostEccentricity(const ImageEllipse& disc, double focal_px) {
  const double ratio = std::min(1.0, disc.semi_minor_px / disc.semi_major_px);
  return disc.semi_major_px * disc.semi_major_px * std::sqrt(1 - ratio * ratio) / focal_px;
}

}  // namespace

Matrix2d MomentsOf(const ImageEllipse& disc) {
  const Eigen::Vector2d along(std::cos(disc.angle_rad), std::sin(disc.angle_rad));
  const Eigen::Vector2d across(-along.y(), along.x());
  return disc.semi_major_px * disc.semi_major_px * along * along.transpose() +
         disc.semi_minor_px * disc.semi_minor_px * across * across.transpose();
}

std::optional<ObjectDisc> DiscOf(const std::vector<DiscShape>& shapes) {
  constexpr std::size_t kMinImages = 3;
  constexpr double kThin = 0.3;   // smallest moment over the middle one: 0 expected
  constexpr double kRound = 1.7;  // largest moment over the middle one: 1 expected
  if (shapes.size() < kMinImages) return std::nullopt;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (const DiscShape& shape : shapes) {
    const double size2 = shape.moments.norm();
    const Eigen::Matrix<double, 3, 6> rows = MomentsByP(shape.by_place) / size2;
    const Matrix2d moments = shape.moments / size2;
    const Vector3d seen(moments(0, 0), std::numbers::sqrt2 * moments(0, 1), moments(1, 1));
    normal += rows.transpose() * rows;
    right += rows.transpose() * seen;
  }
  const Eigen::Matrix<double, 6, 1> p = geometry::SolveSymmetric(normal, right);
  if (!p.allFinite()) return std::nullopt;
  Matrix3d matrix;
  matrix << p[0], p[3], p[4], p[3], p[1], p[5], p[4], p[5], p[2];
  const auto eigen = geometry::DecomposeSymmetric(matrix);
  const double middle = eigen.values[1];
  if (!(middle > 0) || std::abs(eigen.values[0]) > kThin * middle ||
      eigen.values[2] > kRound * middle) {
    return std::nullopt;
  }
  return ObjectDisc{eigen.vectors.col(0), std::sqrt(0.5 * (middle + eigen.values[2]))};
}

void CorrectDiscs(const std::vector<std::optional<ImageEllipse>>& discs,
                  std::vector<bool>& corrected, Network& network) {
  corrected.resize(network.observations.size());
  constexpr double kLeft = 0.1;  // relative error of a correction by a normal 2 degrees off
  const Camera camera = CameraOf(network.lens);
  std::vector<std::vector<std::size_t>> of_point(network.points.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const NetworkObservation& observation = network.observations[i];
    if (network.stations[observation.station].placed && network.points[observation.point].placed)
      of_point[observation.point].push_back(i);
  }
  for (std::size_t p = 0; p < of_point.size(); ++p) {
    const auto disc = FitDisc(network, discs, of_point[p]);
    for (const std::size_t i : of_point[p]) {
      if (!discs[i] || corrected[i]) continue;
      corrected[i] = true;
      NetworkObservation& observation = network.observations[i];
      const Station& station = network.stations[observation.station];
      std::optional<Eigen::Vector2d> off_px;
      if (disc) {
        off_px = Eccentricity(camera, station.FromObject(network.points[p].at),
                              station.rotation * disc->normal, disc->radius);
      }
      if (off_px) observation.pixel -= *off_px;
      const double left_px =
          off_px ? kLeft * off_px->norm() : MostEccentricity(*discs[i], network.lens[kFocal]);
      observation.sigma_px = std::hypot(observation.sigma_px, left_px);
    }
  }
}

}  // namespace trammel::part_alignment

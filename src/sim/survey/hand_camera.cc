#include "sim/survey/hand_camera.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/random.h"

namespace trammel::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<HandShot> WalkAround(const HandWalk& walk, std::uint64_t seed) {
  Random random(seed);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<HandShot> shots;
  for (int i = 0; i < walk.pictures; ++i) {
    const double azimuth = golden * i + random.Uniform(-0.15, 0.15);
    const double elevation = random.Uniform(walk.lowest_rad, walk.highest_rad);
    const Vector3d outward(std::cos(azimuth) * std::cos(elevation),
                           std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
    const Vector3d aim(random.Uniform(-300, 300), random.Uniform(-200, 200), -120);
    HandShot shot;
    shot.place_mm = aim + walk.distance_mm * random.Uniform(0.9, 1.1) * outward;
    shot.ahead = (aim - shot.place_mm).normalized();
    const double roll =
        (walk.rolled && i % 2 == 1 ? 0.5 * std::numbers::pi : 0) + random.Uniform(-0.1, 0.1);
    const Vector3d level = shot.ahead.cross(Vector3d::UnitZ()).normalized();
    shot.right = Eigen::AngleAxisd(roll, shot.ahead) * level;
    shot.down = shot.ahead.cross(shot.right);
    shots.push_back(shot);
  }
  return shots;
}

std::optional<Vector2d> SeenAt(const HandLens& lens, const HandShot& shot, const Vector3d& at_mm,
                               double margin_px) {
  const Vector3d ray = at_mm - shot.place_mm;
  const double depth = ray.dot(shot.ahead);
  constexpr double kWidest = 1.2;  // tan 50 degrees
  if (depth <= 0) return std::nullopt;
  const double a = ray.dot(shot.right) / depth;
  const double b = ray.dot(shot.down) / depth;
  const double q = a * a + b * b;
  if (q > kWidest * kWidest) return std::nullopt;
  const double radial = 1 + q * (lens.k1 + q * lens.k2);
  const Vector2d distorted(a * radial + lens.p2 * (q + 2 * a * a) + 2 * lens.p1 * a * b,
                           b * radial + lens.p1 * (q + 2 * b * b) + 2 * lens.p2 * a * b);
  const Vector2d seen = Vector2d((lens.width_px - 1) / 2.0 + lens.column_off_px,
                                 (lens.height_px - 1) / 2.0 + lens.row_off_px) +
                        lens.focal_px * distorted;
  if (seen.x() < margin_px || seen.x() > lens.width_px - 1 - margin_px || seen.y() < margin_px ||
      seen.y() > lens.height_px - 1 - margin_px) {
    return std::nullopt;
  }
  return seen;
}

std::optional<DiscImage> DiscSeenAt(const HandLens& lens, const HandShot& shot,
                                    const Vector3d& at_mm, const Vector3d& normal, double radius_mm,
                                    double margin_px) {
  const auto centre = SeenAt(lens, shot, at_mm, margin_px);
  if (!centre) return std::nullopt;
  constexpr int kCorners = 64;
  const Vector3d one = radius_mm * normal.unitOrthogonal();
  const Vector3d other = normal.cross(one);
  // Moments of the triangles from the centre's image to the outline's pieces.
  double area = 0;
  Vector2d first = Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  Vector2d corner;
  for (int i = 0; i <= kCorners; ++i) {
    const double turn = 2 * std::numbers::pi * i / kCorners;
    const auto seen =
        SeenAt(lens, shot, at_mm + std::cos(turn) * one + std::sin(turn) * other, margin_px);
    if (!seen) return std::nullopt;
    const Vector2d next = *seen - *centre;
    if (i > 0) {
      const double piece = 0.5 * (corner.x() * next.y() - corner.y() * next.x());
      const Vector2d sum = corner + next;
      area += piece;
      first += piece / 3 * sum;
      second += piece / 12 *
                (sum * sum.transpose() + corner * corner.transpose() + next * next.transpose());
    }
    corner = next;
  }
  const Vector2d middle = first / area;
  const Eigen::Matrix2d moments = second / area - middle * middle.transpose();
  DiscImage image;
  image.centre_px = *centre + middle;
  const double half_trace = 0.5 * moments.trace();
  const double half_difference = 0.5 * (moments(0, 0) - moments(1, 1));
  const double spread = std::hypot(half_difference, moments(0, 1));
  image.major_px = 2 * std::sqrt(half_trace + spread);
  image.minor_px = 2 * std::sqrt(std::max(0.0, half_trace - spread));
  image.angle_rad = 0.5 * std::atan2(moments(0, 1), half_difference);
  return image;
}

}  // namespace trammel::sim

#include "part_alignment/targets/square_lens.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

/// A real camera of 5 megapixels: 6 px of distortion at the picture's border.
Camera RealCamera(CameraConvention convention) {
  Camera camera;
  camera.convention = convention;
  camera.width_px = 2592;
  camera.height_px = 1944;
  camera.pixel_pitch_mm = 0.0022;
  camera.focal_length_mm = 6.19;
  camera.principal_point_offset_px = {12, -7};
  camera.k1 = 6e-9;
  camera.p1 = 2e-7;
  camera.looks_along = LooksAlong::kPlusZ;
  return camera;
}

struct Seen {
  SquareShape shape;
  Eigen::Vector2d middle;
};

/// What a finder that fits straight lines sees of a square in the camera's frame: its edges are
/// drawn as curves of many points, and everything is taken from these.
Seen See(const Camera& camera, const Eigen::Vector3d& at_mm, const Eigen::Matrix3d& turn,
         double half_mm) {
  const double kCorner[5][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-1, -1}};
  std::vector<Eigen::Vector2d> points;
  std::vector<Eigen::Vector2d> directions;
  Seen seen;
  seen.middle = *Project(camera, at_mm);
  constexpr int kPoints = 201;
  for (int k = 0; k < 4; ++k) {
    std::vector<Eigen::Vector2d> edge;
    for (int i = 0; i < kPoints; ++i) {
      const double t = 0.03 + 0.94 * i / (kPoints - 1);
      const Eigen::Vector3d p(kCorner[k][0] + t * (kCorner[k + 1][0] - kCorner[k][0]),
                              kCorner[k][1] + t * (kCorner[k + 1][1] - kCorner[k][1]), 0);
      edge.push_back(*Project(camera, at_mm + turn * (half_mm * p)));
    }
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& p : edge) mean += p / kPoints;
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const auto& p : edge) spread += (p - mean) * (p - mean).transpose();
    points.push_back(mean);
    directions.push_back(geometry::DecomposeSymmetric(spread).vectors.col(1));
    const Eigen::Vector2d chord = (edge.back() - edge.front()).normalized();
    const Eigen::Vector2d off = edge[kPoints / 2] - edge.front();
    const Eigen::Vector2d inwards = seen.middle - edge.front();
    const auto cross = [&](const Eigen::Vector2d& v) {
      return chord.x() * v.y() - chord.y() * v.x();
    };
    const double outwards = cross(inwards) > 0 ? -cross(off) : cross(off);
    seen.shape.bows_px[static_cast<std::size_t>(k)] = outwards / (0.94 * 0.94);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t before = (k + 3) % 4;
    Eigen::Matrix2d system;
    system << directions[before], -directions[k];
    const Eigen::Vector2d t = system.inverse() * (points[k] - points[before]);
    const Eigen::Vector2d corner = points[before] + t.x() * directions[before];
    seen.shape.corners[k] = {corner.x(), corner.y()};
  }
  return seen;
}

double Off(const ImagePoint& found, const Eigen::Vector2d& truth) {
  return std::hypot(found.x - truth.x(), found.y - truth.y());
}

// 160 px of side at 1100 px from the middle: 2 k1 a² R = 0.08 px. What is left is of the next
// order, a / R of it times the tilt's share.
TEST(SquareLens, GivesTheCentreBackThatTheLensMoved) {
  for (const auto convention :
       {CameraConvention::kBrownMeasuredToIdeal, CameraConvention::kBrownIdealToDistorted}) {
    for (const auto side : {LooksAlong::kPlusZ, LooksAlong::kMinusZ}) {
      Camera camera = RealCamera(convention);
      camera.looks_along = side;
      const double z_mm = side == LooksAlong::kPlusZ ? 300 : -300;
      const Eigen::Matrix3d turn = geometry::RotationFromAngles({0.3, -0.2, 0.6});
      const Seen seen = See(camera, {110, -60, z_mm}, turn, 8.5);
      const auto straight = Straighten(camera, seen.shape);
      ASSERT_TRUE(straight);
      EXPECT_GT(Off(CrossingOfDiagonals(seen.shape.corners), seen.middle), 0.03);
      EXPECT_LT(Off(straight->centre, seen.middle), 0.002);
      EXPECT_LT(std::abs(straight->bow_px), 0.005) << "a flat square's bows are the lens's";
      Seen rolled = seen;
      rolled.shape.bows_px[2] += 0.3;
      EXPECT_NEAR(Straighten(camera, rolled.shape)->bow_px, 0.3, 0.005);
    }
  }
}

TEST(SquareLens, WithoutDistortionChangesNothing) {
  Camera camera = RealCamera(CameraConvention::kBrownMeasuredToIdeal);
  camera.k1 = camera.p1 = 0;
  const Eigen::Matrix3d turn = geometry::RotationFromAngles({-0.5, 0.4, 2});
  const Seen seen = See(camera, {-60, 40, 250}, turn, 10);
  const auto straight = Straighten(camera, seen.shape);
  ASSERT_TRUE(straight);
  EXPECT_LT(Off(straight->centre, seen.middle), 1e-8);
  EXPECT_LT(std::abs(straight->bow_px), 1e-8);
}

}  // namespace
}  // namespace trammel::part_alignment

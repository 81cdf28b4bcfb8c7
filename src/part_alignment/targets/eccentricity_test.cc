#include "part_alignment/targets/eccentricity.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "part_alignment/targets/ring_finder.h"
#include "support/target_picture.h"

namespace trammel::part_alignment {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Camera PinHole(LooksAlong side) {
  Camera camera;
  camera.convention = CameraConvention::kBrownIdealToDistorted;
  camera.width_px = 2592;
  camera.height_px = 1944;
  camera.pixel_pitch_mm = 0.0022;
  camera.focal_length_mm = 2813 * 0.0022;
  camera.looks_along = side;
  return camera;
}

Eigen::Vector3d Tilted(double degrees, double towards_rad) {
  return {std::sin(degrees * kDegree) * std::cos(towards_rad),
          std::sin(degrees * kDegree) * std::sin(towards_rad), std::cos(degrees * kDegree)};
}

// 0.068 px at 5 degrees, 0.34 px at 30 degrees, four times that at half the distance: figures of
// the literature's geometry (radius 5 mm, 300 mm, f = 2813 px), computed elsewhere.
TEST(Eccentricity, IsWhatAnObliqueViewOfADiscIsKnownToGive) {
  const Camera camera = PinHole(LooksAlong::kPlusZ);
  const auto size = [&](double distance, double degrees) {
    const auto offset = Eccentricity(camera, {0, 0, distance}, Tilted(degrees, 0.7), 5);
    return offset ? offset->norm() : -1;
  };
  EXPECT_NEAR(size(300, 5), 0.068, 0.001);
  EXPECT_NEAR(size(300, 30), 0.34, 0.005);
  EXPECT_NEAR(size(150, 30) / size(300, 30), 4, 0.02);
  EXPECT_LT(size(300, 0), 1e-9);
}

// u / w with w < 0: the same disc mirrored at the origin's plane changes both signs.
TEST(Eccentricity, ChangesItsSignWhereTheCameraLooksAlongMinusZ) {
  const auto front = Eccentricity(PinHole(LooksAlong::kPlusZ), {20, 10, 300}, Tilted(25, 0.4), 5);
  const auto back = Eccentricity(PinHole(LooksAlong::kMinusZ), {20, 10, -300},
                                 Tilted(25, 0.4).cwiseProduct(Eigen::Vector3d(1, 1, -1)), 5);
  ASSERT_TRUE(front && back);
  EXPECT_LT((*front + *back).norm(), 1e-9);
}

TEST(Eccentricity, IsAbsentWhereTheRimCannotBeSeen) {
  const Camera camera = PinHole(LooksAlong::kPlusZ);
  EXPECT_FALSE(Eccentricity(camera, {0, 0, -300}, {0, 0, 1}, 5));
  EXPECT_FALSE(Eccentricity(camera, {0, 0, 300}, {0, 0, 0}, 5));
  EXPECT_FALSE(Eccentricity(camera, {0, 0, 300}, {std::nan(""), 0, 1}, 5));
  EXPECT_FALSE(Eccentricity(camera, {0, 0, 3}, {1, 0, 0.01}, 5));
  EXPECT_FALSE(Eccentricity(camera, {0, 0, 300}, {0, 0, 1}, -5));
}

// Drawn in perspective, found, corrected: what remains is below a grey level's noise of 0.003 px.
TEST(Eccentricity, TakenOffWhatIsFoundLeavesTheImageOfTheCentre) {
  const CodeBook book = MakeCodeBook(14).value();
  const Camera camera = PinHole(LooksAlong::kPlusZ);
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  FinderWorkspace workspace;
  for (const double degrees : {5.0, 15.0, 30.0}) {
    for (int i = 0; i < 3; ++i) {
      const double radius_mm = random.Uniform(1.0, 2.2);
      const Eigen::Vector3d centre{random.Uniform(-20, 20), random.Uniform(-20, 20), 300};
      const Eigen::Vector3d normal = Tilted(degrees, random.Uniform(0, 6.3));
      const Eigen::Vector3d u = normal.unitOrthogonal() * radius_mm;
      const Eigen::Vector3d v = normal.cross(u);
      const Eigen::Vector2d truth = Project(camera, centre).value();
      const Eigen::Vector2d corner(std::floor(truth.x()) - 110, std::floor(truth.y()) - 110);
      test::DrawnTarget target;
      target.bits = 14;
      target.word = book.words[static_cast<std::size_t>(i)];
      const double f = camera.focal_length_mm / camera.pixel_pitch_mm;
      const double c[2] = {PrincipalPoint(camera).x() - corner.x(),
                           PrincipalPoint(camera).y() - corner.y()};
      const Eigen::Vector3d columns[3] = {u, v, centre};
      for (int k = 0; k < 3; ++k) {
        target.h[0][k] = f * columns[k].x() + c[0] * columns[k].z();
        target.h[1][k] = f * columns[k].y() + c[1] * columns[k].z();
        target.h[2][k] = columns[k].z();
      }
      const Page page = test::Expose(test::Draw(220, 220, {target}, {.blur_px = 0.6}), 0, random);
      const auto found = FindTargets(page.view(), book, {}, workspace);
      ASSERT_TRUE(found && found->targets.size() == 1) << "seed " << kSeed << ", tilt " << degrees;
      const auto offset = Eccentricity(camera, centre, normal, radius_mm);
      ASSERT_TRUE(offset);
      const Eigen::Vector2d seen(found->targets[0].disc.column_px, found->targets[0].disc.row_px);
      EXPECT_LT((seen + corner - *offset - truth).norm(), 0.003) << "tilt " << degrees;
    }
  }
}

}  // namespace
}  // namespace trammel::part_alignment

#include "part_alignment/camera/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/random.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Tolerance of Newton's inversion (1e-12 px) and of rounding positions up to 3000 px.
constexpr double kInversion_px = 2e-12;
/// Tolerance of the numbers below, which were printed with ten digits.
constexpr double kPrinted_px = 1e-9;

/// Table 1 of Mendikute et al.
Camera TableOne() {
  Camera camera;
  camera.width_px = 2592;
  camera.height_px = 1944;
  camera.pixel_pitch_mm = 0.0022;
  camera.focal_length_mm = 6.189;
  camera.principal_point_offset_px = {-8.732, 27.52};
  camera.k1 = 2.997e-8;
  camera.k2 = -1.937e-15;
  camera.p1 = -6.188e-8;
  camera.p2 = 3.408e-7;
  camera.taper_from_camera = {{-2.139, 0.301, -320.3}, {-0.003, -0.009, 0.03}};
  return camera;
}

Camera OpenCvs() {
  Camera camera = TableOne();
  camera.convention = CameraConvention::kBrownIdealToDistorted;
  return camera;
}

void ExpectPixel(const Camera& camera, const Vector3d& point, double column_px, double row_px) {
  const auto pixel = Must(Project(camera, point));
  EXPECT_NEAR(pixel.x(), column_px, kPrinted_px);
  EXPECT_NEAR(pixel.y(), row_px, kPrinted_px);
}

// The numbers come from a program of its own (numpy, fixed-point inversion) written from the paper:
// the direction of the polynomial, the order of the tangential terms and the image's centre each
// shift them by far more than kPrinted_px.
TEST(Camera, ProjectsTablesOneAsAnIndependentProgramDoes) {
  ExpectPixel(TableOne(), {40, -25, -150}, 552.6170593519, 1457.6427759016);
  ExpectPixel(TableOne(), {-31, 22, -160}, 1825.1879109622, 616.7876876674);
  ExpectPixel(TableOne(), {90, 60, -300}, 465.1556713804, 450.9156079309);
}

TEST(Camera, ProjectsOpenCvsConventionAsAnIndependentProgramDoes) {
  ExpectPixel(OpenCvs(), {40, -25, -150}, 520.5747066785, 1478.0090757250);
  ExpectPixel(OpenCvs(), {-31, 22, -160}, 1839.2892145418, 606.9885679211);
  ExpectPixel(OpenCvs(), {90, 60, -300}, 419.2988618233, 420.4098302327);
}

TEST(Camera, LinesOfSightLeadBackToTheirPixels) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  Random random(kSeed);
  for (Camera camera : {TableOne(), OpenCvs()}) {
    for (const LooksAlong side : {LooksAlong::kMinusZ, LooksAlong::kPlusZ}) {
      camera.looks_along = side;
      for (int i = 0; i < 2000; ++i) {
        const Vector2d pixel{random.Uniform(0, 2591), random.Uniform(0, 1943)};
        const auto line = LineOfSight(camera, pixel);
        ASSERT_TRUE(line) << pixel;
        EXPECT_NEAR(line->norm(), 1, 1e-15);
        EXPECT_EQ(line->z() > 0, side == LooksAlong::kPlusZ);
        const auto back = Project(camera, random.Uniform(50, 3000) * *line);
        ASSERT_TRUE(back) << pixel;
        EXPECT_LT((*back - pixel).norm(), 2 * kInversion_px) << pixel;
      }
    }
  }
}

TEST(Camera, APictureOfWhatLiesAtNegativeWIsTurnedByHalfATurn) {
  Camera camera = TableOne();
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = 0;
  const Vector2d offset = *Project(camera, {10, 5, -100}) - PrincipalPoint(camera);
  EXPECT_NEAR(offset.x(), -0.1 * 6.189 / 0.0022, 1e-9);
  EXPECT_NEAR(offset.y(), -0.05 * 6.189 / 0.0022, 1e-9);
  EXPECT_FALSE(Project(camera, {10, 5, 100}));
  camera.looks_along = LooksAlong::kPlusZ;
  EXPECT_TRUE(Project(camera, {10, 5, 100}));
  EXPECT_FALSE(Project(camera, {10, 5, -100}));
}

TEST(Camera, DerivativesAreThoseOfFiniteDifferences) {
  constexpr double kRelative = 1e-7;
  constexpr double kStep_mm = 1e-3;
  for (const Camera& camera : {TableOne(), OpenCvs()}) {
    for (const Vector3d& point :
         {Vector3d(40, -25, -150), Vector3d(-60, 45, -200), Vector3d(1, 2, -300)}) {
      const auto projection = Must(ProjectWithDerivative(camera, point));
      for (int i = 0; i < 3; ++i) {
        // Fourth order: (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12 h.
        const auto at = [&](double steps) {
          return *Project(camera, point + steps * kStep_mm * Vector3d::Unit(i));
        };
        const Vector2d numeric = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * kStep_mm);
        EXPECT_LT((projection.by_point.col(i) - numeric).norm(),
                  kRelative * projection.by_point.norm());
      }
      const auto with_focal = [&](double steps) {
        Camera changed = camera;
        changed.focal_length_mm += steps * kStep_mm;
        return *Project(changed, point);
      };
      const Vector2d numeric =
          (8 * (with_focal(1) - with_focal(-1)) - (with_focal(2) - with_focal(-2))) /
          (12 * kStep_mm);
      EXPECT_LT((projection.by_focal_length - numeric).norm(),
                kRelative * projection.by_focal_length.norm());
    }
  }
}

TEST(Camera, SaysNothingWhereTheLensFolds) {
  // r (1 + k1 r²) turns back at r = 1 / sqrt(-3 k1) = 1826 px, where it is 1217 px.
  Camera camera = TableOne();
  camera.k1 = -1e-7;
  camera.k2 = camera.p1 = camera.p2 = 0;
  camera.width_px = camera.height_px = 6001;
  camera.principal_point_offset_px.setZero();
  const double mm_per_px = 0.0022 / 6.189;
  const auto at_ideal = [&](double r_px) { return Vector3d(-r_px * mm_per_px, 0, -1); };
  EXPECT_TRUE(Project(camera, at_ideal(1217)));
  EXPECT_FALSE(Project(camera, at_ideal(1218)));
  EXPECT_TRUE(LineOfSight(camera, PrincipalPoint(camera) + Vector2d(0, 1825)));
  EXPECT_FALSE(LineOfSight(camera, PrincipalPoint(camera) + Vector2d(0, 1827)));
  camera.convention = CameraConvention::kBrownIdealToDistorted;
  EXPECT_TRUE(Project(camera, at_ideal(1825)));
  EXPECT_FALSE(Project(camera, at_ideal(1827)));
  EXPECT_TRUE(LineOfSight(camera, PrincipalPoint(camera) + Vector2d(0, 1217)));
  EXPECT_FALSE(LineOfSight(camera, PrincipalPoint(camera) + Vector2d(0, 1218)));
}

TEST(Camera, NumbersThatAreNoneProjectNowhere) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double huge = std::numeric_limits<double>::max();
  for (const Camera& camera : {TableOne(), OpenCvs()}) {
    EXPECT_FALSE(Project(camera, {nan, 0, -100}));
    EXPECT_FALSE(Project(camera, {huge, 0, -1e-300}));
    EXPECT_FALSE(Project(camera, {0, 0, 0}));
    EXPECT_FALSE(LineOfSight(camera, {nan, 0}));
    EXPECT_FALSE(LineOfSight(camera, {huge, 0}));
  }
}

TEST(Camera, ValidateNamesTheFieldThatCannotBe) {
  EXPECT_TRUE(Validate(TableOne()));
  Camera camera = TableOne();
  camera.pixel_pitch_mm = 2.2;
  ASSERT_FALSE(Validate(camera));
  EXPECT_NE(Validate(camera).error().message.find("pixel_pitch_mm is 2.2"), std::string::npos);
  camera = TableOne();
  camera.k1 = std::numeric_limits<double>::quiet_NaN();
  ASSERT_FALSE(Validate(camera));
  EXPECT_NE(Validate(camera).error().message.find("k1 is nan"), std::string::npos);
  camera = TableOne();
  camera.k1 = 0.237;  // in focal lengths, as OpenCV gives it
  EXPECT_FALSE(Validate(camera));
}

}  // namespace
}  // namespace trammel::part_alignment

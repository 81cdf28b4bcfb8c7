#include "sim/laser/laser_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "sim/camera/jpeg.h"
#include "sim/laser/laser_test_support.h"

namespace trammel::sim {
namespace {

constexpr double kLineY = 100;
// Contract of Render: 0.05 px. The eight-bit centroid of these tests adds less than 0.01 px.
constexpr double kPositionTolerancePx = 0.05;

LaserTraits IdealLaserCamera() {
  LaserTraits optics;
  optics.plate.peak = 0.9;
  optics.filament.peak = 0.9;
  return optics;
}

Frame RenderIdeal(const Bed& bed, const LaserTraits& optics, double laser_mm,
                  const SensorWindow& window) {
  LaserCamera camera(Condition{}, optics, window, Random(1));
  const LaserScene scene = camera.MakeScene(bed, kLineY, laser_mm - 1, laser_mm + 1);
  Random random(2);
  Frame frame;
  camera.Render(scene, laser_mm, 0, 1, random, frame);
  return frame;
}

// Computes the full-sensor column of the sheet's point at height z, for a pinhole at distance_mm.
double ExpectedColumn(const LaserTraits& optics, double z_mm) {
  const double focal_px = optics.px_per_mm * optics.distance_mm;
  const double foot_mm =
      (optics.stripe_column_px - 640) / optics.px_per_mm;  // from the optical axis
  return 640 + (foot_mm - z_mm * std::tan(optics.laser_angle_rad)) * focal_px /
                   (optics.distance_mm - z_mm);
}

TEST(LaserCamera, StripeOnABarePlateIsStraightAndWhereTheTraitsSay) {
  LaserTraits optics = IdealLaserCamera();
  optics.stripe_column_px = 871.37;
  const SensorWindow window = WindowAroundCrop(160, 120);
  const Frame frame = RenderIdeal(Bed{}, optics, 50, window);
  for (int row = 0; row < frame.height; ++row) {
    EXPECT_NEAR(StripeColumn(frame, row) + window.x, 871.37, kPositionTolerancePx) << row;
  }
}

TEST(LaserCamera, TiltTurnsTheStripe) {
  LaserTraits optics = IdealLaserCamera();
  optics.stripe_tilt_rad = 0.008;
  const SensorWindow window = WindowAroundCrop(160, 120);
  const Frame frame = RenderIdeal(Bed{}, optics, 50, window);
  for (const int row : {5, 60, 115}) {
    const double expected = 872 + (row + window.y - optics.line_row_px) * std::tan(0.008);
    EXPECT_NEAR(StripeColumn(frame, row) + window.x, expected, kPositionTolerancePx) << row;
  }
}

TEST(LaserCamera, BoxShiftsTheStripeAsTheGeometrySays) {
  for (const double angle : {0.6, 0.785398163397448, 1.0}) {
    for (const double height : {0.1, 0.25, 0.6}) {
      LaserTraits optics = IdealLaserCamera();
      optics.laser_angle_rad = angle;
      // A bead 6 mm wide whose section fills its rectangle: flat across the whole window.
      Bed bed = StraightBead(40, 60, kLineY, 6, height);
      for (BeadSample& sample : bed.strands[0].samples) sample.area_mm2 = 6 * height;
      const SensorWindow window = WindowAroundCrop(160, 64);
      const Frame frame = RenderIdeal(bed, optics, 50, window);
      EXPECT_NEAR(StripeColumn(frame, 32) + window.x, ExpectedColumn(optics, height),
                  kPositionTolerancePx)
          << "angle " << angle << ", height " << height;
    }
  }
}

TEST(LaserCamera, LightFromTheSideLeavesAShadowBesideTheBead) {
  LaserTraits optics = IdealLaserCamera();
  const SensorWindow window = WindowAroundCrop(160, 120);
  const auto light = [&](double offset_mm, int row) {
    optics.fan_offset_mm = offset_mm;
    const Frame frame = RenderIdeal(StraightBead(40, 60, kLineY, 0.7, 0.6), optics, 50, window);
    return RedPeak(frame, row);
  };
  // The bead's lower edge in the image lies 15 rows below row 60 of the window.
  const int below = 60 + static_cast<int>(0.35 * 44) + 3;
  EXPECT_GT(light(0, below), 200);
  EXPECT_LT(light(20, below), 100);
}

TEST(LaserCamera, EqualSeedsGiveEqualBytesAndOthersDiffer) {
  const auto bytes = [](std::uint64_t seed) {
    Random random(seed);
    const Condition condition{Plate::kTextured, Filament::kWhite, true};
    LaserCamera camera(condition, DrawLaserTraits(condition, random), WindowAroundCrop(160, 120),
                       random.Fork(1));
    const LaserScene scene =
        camera.MakeScene(StraightBead(40, 60, kLineY, 0.5, 0.25), kLineY, 49, 51);
    Frame frame;
    camera.Render(scene, 50, 0.1, 1, random, frame);
    std::vector<std::uint8_t> jpeg;
    EncodeJpeg(frame.view(), 85, jpeg);
    return jpeg;
  };
  EXPECT_EQ(bytes(7), bytes(7));
  EXPECT_NE(bytes(7), bytes(8));
}

}  // namespace
}  // namespace trammel::sim

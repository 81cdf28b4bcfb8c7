#include "sim/laser/laser_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/camera/jpeg.h"
#include "sim/laser/laser_test_support.h"

namespace trammel::sim {
namespace {

constexpr double kLineY = 100;
// Contract of Render: 0.05 px. The eight-bit centroid of these tests adds less than 0.01 px.
constexpr double kPositionTolerancePx = 0.05;

LaserTraits IdealEye() {
  LaserTraits eye;
  eye.plate.peak = 0.9;
  eye.filament.peak = 0.9;
  return eye;
}

Frame RenderIdeal(const Bed& bed, const LaserTraits& eye, double laser_mm,
                  const SensorWindow& window) {
  LaserCamera camera(Condition{}, eye, window, Random(1));
  const LaserScene scene = camera.MakeScene(bed, kLineY, laser_mm - 1, laser_mm + 1);
  Random random(2);
  Frame frame;
  camera.Render(scene, laser_mm, 0, 1, random, frame);
  return frame;
}

// Where a pinhole at distance_mm sees the sheet's point at height z, in full-sensor columns.
double ExpectedColumn(const LaserTraits& eye, double z_mm) {
  const double focal_px = eye.px_per_mm * eye.distance_mm;
  const double foot_mm = (eye.stripe_column_px - 640) / eye.px_per_mm;  // from the optical axis
  return 640 +
         (foot_mm - z_mm * std::tan(eye.laser_angle_rad)) * focal_px / (eye.distance_mm - z_mm);
}

TEST(LaserCamera, StripeOnABarePlateIsStraightAndWhereTheTraitsSay) {
  LaserTraits eye = IdealEye();
  eye.stripe_column_px = 871.37;
  const SensorWindow window = WindowAroundCrop(160, 120);
  const Frame frame = RenderIdeal(Bed{}, eye, 50, window);
  for (int row = 0; row < frame.height; ++row) {
    EXPECT_NEAR(StripeColumn(frame, row) + window.x, 871.37, kPositionTolerancePx) << row;
  }
}

TEST(LaserCamera, TiltTurnsTheStripe) {
  LaserTraits eye = IdealEye();
  eye.stripe_tilt_rad = 0.008;
  const SensorWindow window = WindowAroundCrop(160, 120);
  const Frame frame = RenderIdeal(Bed{}, eye, 50, window);
  for (const int row : {5, 60, 115}) {
    const double expected = 872 + (row + window.y - eye.line_row_px) * std::tan(0.008);
    EXPECT_NEAR(StripeColumn(frame, row) + window.x, expected, kPositionTolerancePx) << row;
  }
}

TEST(LaserCamera, BoxShiftsTheStripeAsTheGeometrySays) {
  for (const double angle : {0.6, 0.785398163397448, 1.0}) {
    for (const double height : {0.1, 0.25, 0.6}) {
      LaserTraits eye = IdealEye();
      eye.laser_angle_rad = angle;
      // A bead 6 mm wide whose section fills its rectangle: flat across the whole window.
      Bed bed = StraightBead(40, 60, kLineY, 6, height);
      for (BeadSample& sample : bed.strands[0].samples) sample.area_mm2 = 6 * height;
      const SensorWindow window = WindowAroundCrop(160, 64);
      const Frame frame = RenderIdeal(bed, eye, 50, window);
      EXPECT_NEAR(StripeColumn(frame, 32) + window.x, ExpectedColumn(eye, height),
                  kPositionTolerancePx)
          << "angle " << angle << ", height " << height;
    }
  }
}

TEST(LaserCamera, RowsShowTheBeadAtItsWidth) {
  const SensorWindow window = WindowAroundCrop(160, 120);
  const LaserTraits eye = IdealEye();
  const Frame frame = RenderIdeal(StraightBead(40, 60, kLineY, 0.8, 0.3), eye, 50, window);
  int risen = 0;
  for (int row = 0; row < frame.height; ++row) {
    if (StripeColumn(frame, row) + window.x < 872 - 2) ++risen;
  }
  EXPECT_NEAR(risen, 0.8 * 44, 3);  // a row of blur at either flank and one of rounding
}

TEST(LaserCamera, LightFromTheSideLeavesAShadowBesideTheBead) {
  LaserTraits eye = IdealEye();
  const SensorWindow window = WindowAroundCrop(160, 120);
  const auto light = [&](double offset_mm, int row) {
    eye.fan_offset_mm = offset_mm;
    const Frame frame = RenderIdeal(StraightBead(40, 60, kLineY, 0.7, 0.6), eye, 50, window);
    return RedPeak(frame, row);
  };
  // The bead's lower edge in the image lies 15 rows below row 60 of the window.
  const int below = 60 + static_cast<int>(0.35 * 44) + 3;
  EXPECT_GT(light(0, below), 200);
  EXPECT_LT(light(20, below), 100);
}

TEST(LaserCamera, BlackFilamentReturnsAboutAThirdOfThePlatesLight) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    const Condition condition{Plate::kMatte, Filament::kBlack, false};
    LaserTraits eye = DrawLaserTraits(condition, random);
    eye.plate.peak *= 0.8;  // away from saturation, which hides the ratio
    eye.filament.peak *= 0.8;
    LaserCamera camera(condition, eye, WindowAroundCrop(160, 120), random.Fork(1));
    const LaserScene scene =
        camera.MakeScene(StraightBead(40, 60, kLineY, 0.5, 0.25), kLineY, 49, 51);
    double plate = 0;
    double filament = 0;
    Frame frame;
    for (int i = 0; i < 10; ++i) {
      camera.Render(scene, 49 + 0.2 * i, 0.1, 1, random, frame);
      for (int row = 55; row < 65; ++row) filament += RedPeak(frame, row);
      for (int row = 10; row < 20; ++row) plate += RedPeak(frame, row);
    }
    EXPECT_GT(filament / plate, 0.25) << "seed " << seed;
    EXPECT_LT(filament / plate, 0.55) << "seed " << seed;
  }
}

TEST(LaserCamera, ConditionsDifferAsTheyShould) {
  const auto render = [](Plate plate, Filament filament, bool ambient) {
    const Condition condition{plate, filament, ambient};
    Random random(5);
    const LaserTraits eye = DrawLaserTraits(condition, random);
    LaserCamera camera(condition, eye, WindowAroundCrop(160, 120), Random(6));
    const LaserScene scene =
        camera.MakeScene(StraightBead(40, 60, kLineY, 0.5, 0.25), kLineY, 49, 51);
    Frame frame;
    camera.Render(scene, 50, 0.1, 1, random, frame);
    return frame;
  };
  const auto lit_columns = [](const Frame& frame) {  // well above the background, off the bead
    int count = 0;
    for (int row = 5; row < 25; ++row) {
      for (int x = 0; x < frame.width; ++x) count += frame.view().row(row)[3 * x + 2] > 80 ? 1 : 0;
    }
    return count;
  };
  const auto background = [](const Frame& frame) {
    int sum = 0;
    for (int row = 5; row < 25; ++row) sum += frame.view().row(row)[3 * 2 + 1];
    return sum / 20;
  };
  const Frame matte = render(Plate::kMatte, Filament::kBlack, false);
  EXPECT_GT(lit_columns(render(Plate::kPei, Filament::kBlack, false)), 1.3 * lit_columns(matte));
  EXPECT_GT(background(render(Plate::kMatte, Filament::kBlack, true)), background(matte) + 10);
  EXPECT_GT(RedPeak(render(Plate::kMatte, Filament::kWhite, false), 60), RedPeak(matte, 60) + 80);
}

TEST(LaserCamera, SaturatedRedTurnsPinkAndTheWeakStaysRed) {
  LaserTraits eye = IdealEye();
  eye.plate.peak = 1.2;
  const SensorWindow window = WindowAroundCrop(160, 120);
  const Frame bright = RenderIdeal(Bed{}, eye, 50, window);
  const std::uint8_t* pink = bright.view().row(60) + std::ptrdiff_t{3} * (872 - window.x);
  EXPECT_EQ(pink[2], 255);
  EXPECT_GT(pink[1], 100);
  eye.plate.peak = 0.4;
  const Frame dim = RenderIdeal(Bed{}, eye, 50, window);
  const std::uint8_t* red = dim.view().row(60) + std::ptrdiff_t{3} * (872 - window.x);
  EXPECT_NEAR(red[2], 102, 3);
  EXPECT_EQ(red[1], 0);
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

TEST(LaserCamera, FullFramesShowTheCropWhereThePaperHasIt) {
  const Frame full = RenderIdeal(StraightBead(40, 60, kLineY, 0.5, 0.25), IdealEye(), 50,
                                 WindowAroundCrop(1280, 720));
  const Frame small = RenderIdeal(StraightBead(40, 60, kLineY, 0.5, 0.25), IdealEye(), 50,
                                  WindowAroundCrop(160, 120));
  const SensorWindow window = WindowAroundCrop(160, 120);
  EXPECT_EQ(full.width, 1280);
  EXPECT_EQ(full.height, 720);
  for (int row = 0; row < 120; ++row) {
    EXPECT_NEAR(StripeColumn(full, row + window.y), StripeColumn(small, row) + window.x, 0.1);
  }
}

}  // namespace
}  // namespace trammel::sim

#include "sim/camera/camera_view.h"

#include <gtest/gtest.h>

#include <memory>

#include "sim/laser/laser_test_support.h"

namespace trammel::sim {
namespace {

// Contract of LaserCamera::Render, 0.05 px, and 0.01 px of the eight-bit centroid.
constexpr double kPositionTolerancePx = 0.06;
constexpr double kFocusMm = 17.86;
constexpr double kFineMoveMm = 0.5;

HeadOptics IdealLaserCamera() {
  HeadOptics optics;
  optics.dark.plate.peak = 0.9;
  optics.dark.filament.peak = 0.9;
  optics.lit = optics.dark;
  optics.lit.plate.ambient_bgr = {48, 42, 31};
  optics.lit.filament.ambient_bgr = {90, 97, 100};
  return optics;
}

// The head stands so that the laser meets the plate at (x, y) when in focus.
CameraMoment HeadAt(const Bed& bed, double x_mm, double y_mm, double z_mm = kFocusMm) {
  CameraMoment moment;
  moment.machine = {x_mm - 28, y_mm - 50.2, z_mm, 0, true, false};
  moment.bed = std::make_shared<Bed>(bed);
  return moment;
}

CameraViewOptions Window(int width_px, int height_px) { return {{}, width_px, height_px}; }

Frame Look(const CameraMoment& moment, int width_px = 160, int height_px = 120) {
  CameraView view(IdealLaserCamera(), Window(width_px, height_px), Random(1));
  Frame frame;
  view.Render(moment, frame);
  return frame;
}

int Brightest(const Frame& frame) {
  int brightest = 0;
  for (int row = 0; row < frame.height; ++row) brightest = std::max(brightest, RedPeak(frame, row));
  return brightest;
}

const Bed kBare{250, 250, {}};

TEST(CameraView, StripeStandsWhereTheTraitsSayAtTheFocusHeight) {
  const SensorWindow window = WindowAroundCrop(160, 120);
  const Frame frame = Look(HeadAt(kBare, 100, 100));
  for (const int row : {5, 60, 115}) {
    EXPECT_NEAR(StripeColumn(frame, row) + window.x, 872, kPositionTolerancePx) << row;
  }
}

TEST(CameraView, OffsetPutsTheLaserOnTheLineThatWasPrinted) {
  // A line that begins at x = 100 mm, y = 120 mm: seen where the laser stands, and not before.
  const Bed bed = StraightBead(100, 130, 120, 0.6, 0.3);
  const SensorWindow window = WindowAroundCrop(160, 120);
  const auto risen_px = [&](double x_mm) {
    return 872 - (StripeColumn(Look(HeadAt(bed, x_mm, 120)), 371 - window.y) + window.x);
  };
  // The sheet meets the top 0.3 mm nearer to the axis and to the lens.
  const double axis_mm = (872 - 640) / 44.0;
  EXPECT_NEAR(risen_px(110), 44 * (axis_mm - (axis_mm - 0.3) * 34.5 / (34.5 - 0.3)), 0.2);
  EXPECT_NEAR(risen_px(98), 0, kPositionTolerancePx);
}

TEST(CameraView, RaisingTheHeadMovesTheStripeAsThePinholeSays) {
  for (const double rise_mm : {-4.0, -1.0, -0.25, 0.25, 1.0, 4.0}) {
    const Frame frame = Look(HeadAt(kBare, 100, 100, kFocusMm + rise_mm), 1280, 64);
    // The sheet leans by 45 degrees: the laser meets the plate `rise` further from the axis.
    const double from_axis_mm = (872 - 640) / 44.0 + rise_mm;
    const double expected = 640 + from_axis_mm * 44 * 34.5 / (34.5 + rise_mm);
    EXPECT_NEAR(StripeColumn(frame, 32), expected, 3 * kPositionTolerancePx) << rise_mm;
  }
}

TEST(CameraView, NoStripeWithTheLaserOff) {
  CameraMoment moment = HeadAt(kBare, 100, 100);
  moment.machine.laser_on = false;
  EXPECT_LT(Brightest(Look(moment)), 8);
  moment.machine.laser_on = true;
  EXPECT_GT(Brightest(Look(moment)), 200);
}

TEST(CameraView, WhatIsKeptBetweenFramesShowsWhatAFreshViewShows) {
  const Bed bed = StraightBead(100, 130, 120, 0.6, 0.3);
  CameraView kept(IdealLaserCamera(), Window(160, 120), Random(1));
  Frame frame;
  for (int i = 0; i < 60; ++i) {
    CameraMoment moment = HeadAt(bed, 98 + kFineMoveMm * i, 120 + 0.02 * i, kFocusMm + 0.01 * i);
    moment.machine.lights_on = i % 7 == 3;
    moment.travel_x_mm = 0.05;
    kept.Render(moment, frame);
    EXPECT_EQ(frame.bgr, Look(moment).bgr) << i;
  }
}

}  // namespace
}  // namespace trammel::sim

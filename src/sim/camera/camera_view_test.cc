#include "sim/camera/camera_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "sim/laser/laser_test_support.h"

namespace trammel::sim {
namespace {

// Contract of LaserCamera::Render, 0.05 px, and 0.01 px of the eight-bit centroid.
constexpr double kPositionTolerancePx = 0.06;
constexpr double kFocusMm = 17.86;
constexpr double kFineMoveMm = 0.5;

HeadEye IdealEye() {
  HeadEye eye;
  eye.dark.plate.peak = 0.9;
  eye.dark.filament.peak = 0.9;
  eye.lit = eye.dark;
  eye.lit.plate.ambient_bgr = {48, 42, 31};
  eye.lit.filament.ambient_bgr = {90, 97, 100};
  return eye;
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
  CameraView view(IdealEye(), Window(width_px, height_px), Random(1));
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

TEST(CameraView, StripeIsSharpestAtTheFocusHeight) {
  const auto width_px = [](double rise_mm) {
    const Frame frame = Look(HeadAt(kBare, 100, 100, kFocusMm + rise_mm), 1280, 64);
    const double centre = StripeColumn(frame, 32);
    double sum = 0;
    double spread = 0;
    for (int x = 0; x < frame.width; ++x) {
      const double red = frame.view().row(32)[3 * x + 2];
      sum += red;
      spread += red * (x - centre) * (x - centre);
    }
    return std::sqrt(spread / sum);
  };
  const double sharp = width_px(0);
  EXPECT_NEAR(sharp, 2.7, 0.1);
  EXPECT_GT(width_px(2), 1.15 * sharp);
  EXPECT_GT(width_px(-2), 1.15 * sharp);
  EXPECT_GT(width_px(6), width_px(2));
}

TEST(CameraView, NoStripeWithTheLaserOff) {
  CameraMoment moment = HeadAt(kBare, 100, 100);
  moment.machine.laser_on = false;
  EXPECT_LT(Brightest(Look(moment)), 8);
  moment.machine.laser_on = true;
  EXPECT_GT(Brightest(Look(moment)), 200);
}

TEST(CameraView, NoStripeFarAboveTheFocusHeight) {
  // 30 mm up the laser meets the plate 35 mm from the axis; the image ends 27 mm from it.
  EXPECT_LT(Brightest(Look(HeadAt(kBare, 100, 100, kFocusMm + 30), 1280, 720)), 8);
}

// Speckle is a matter of surface and place, not of time: a standing head sees only noise change.
TEST(CameraView, SpeckleStaysWhileTheHeadStands) {
  HeadEye eye = IdealEye();
  eye.dark.plate.speckle = 0.3;
  CameraView view(eye, Window(160, 120), Random(1));
  const auto red = [&](double x_mm) {
    Frame frame;
    view.Render(HeadAt(kBare, x_mm, 100), frame);
    return frame;
  };
  const auto difference = [](const Frame& a, const Frame& b) {
    double sum = 0;
    for (std::size_t i = 2; i < a.bgr.size(); i += 3) sum += std::pow(a.bgr[i] - b.bgr[i], 2);
    return std::sqrt(sum / (static_cast<double>(a.bgr.size()) / 3));
  };
  const Frame before = red(100);
  EXPECT_LT(difference(before, red(100)), 0.3 * difference(before, red(100.2)));
  EXPECT_LT(difference(before, red(100)), 0.3 * difference(before, red(100.05)));
}

TEST(CameraView, LightsShowThePlateAndItsLines) {
  CameraMoment moment = HeadAt(StraightBead(100, 130, 120, 0.6, 0.3), 115, 120);
  moment.machine.laser_on = false;
  const SensorWindow window = WindowAroundCrop(160, 120);
  const auto green = [](const Frame& frame, int row) { return frame.view().row(row)[3 * 20 + 1]; };
  EXPECT_EQ(green(Look(moment), 10), 0);
  moment.machine.lights_on = true;
  const Frame lit = Look(moment);
  EXPECT_NEAR(green(lit, 10), 42, 3);
  EXPECT_GT(green(lit, 371 - window.y), 70);
}

TEST(CameraView, BesideTheBedIsNothing) {
  CameraMoment moment = HeadAt(kBare, -60, 100);
  moment.machine.lights_on = true;
  EXPECT_LT(Brightest(Look(moment)), 8);
  // With the bed's left edge under the laser the left half of the image is dark.
  moment = HeadAt(kBare, 0, 100);
  moment.machine.lights_on = true;
  moment.machine.laser_on = false;
  const Frame edge = Look(moment);
  EXPECT_EQ(edge.view().row(60)[3 * 20 + 1], 0);
  EXPECT_NEAR(edge.view().row(60)[3 * 150 + 1], 42, 3);
}

TEST(CameraView, MovingAlongXSmearsTheEndOfALine) {
  const Bed bed = StraightBead(100, 130, 120, 0.6, 0.3);
  CameraMoment moment = HeadAt(bed, 115, 120);
  moment.machine.lights_on = true;
  moment.machine.laser_on = false;
  moment.machine.x_mm -= 15;                  // the line's start under the laser's place
  const auto steps = [&](double travel_mm) {  // columns between plate and full filament
    moment.travel_x_mm = travel_mm;
    const Frame frame = Look(moment);
    int count = 0;
    const SensorWindow window = WindowAroundCrop(160, 120);
    for (int x = 0; x < frame.width; ++x) {
      const int green = frame.view().row(371 - window.y)[3 * x + 1];
      count += green > 48 && green < 90 ? 1 : 0;
    }
    return count;
  };
  EXPECT_GT(steps(1.5), steps(0) + 30);
}

TEST(CameraView, WhatIsKeptBetweenFramesShowsWhatAFreshViewShows) {
  const Bed bed = StraightBead(100, 130, 120, 0.6, 0.3);
  CameraView kept(IdealEye(), Window(160, 120), Random(1));
  Frame frame;
  for (int i = 0; i < 60; ++i) {
    CameraMoment moment = HeadAt(bed, 98 + kFineMoveMm * i, 120 + 0.02 * i, kFocusMm + 0.01 * i);
    moment.machine.lights_on = i % 7 == 3;
    moment.travel_x_mm = 0.05;
    kept.Render(moment, frame);
    EXPECT_EQ(frame.bgr, Look(moment).bgr) << i;
  }
}

TEST(CameraView, ALineThatIsPrintedAppears) {
  CameraView view(IdealEye(), Window(160, 120), Random(1));
  const int row = 371 - WindowAroundCrop(160, 120).y;
  Frame frame;
  view.Render(HeadAt(kBare, 115, 120), frame);
  const double bare = StripeColumn(frame, row);
  Bed bed = StraightBead(100, 130, 120, 0.6, 0.3);
  view.Render(HeadAt(bed, 115, 120), frame);
  EXPECT_LT(StripeColumn(frame, row), bare - 10);
  bed.strands.push_back(StraightBead(100, 130, 121, 0.6, 0.5).strands[0]);
  view.Render(HeadAt(bed, 115, 120), frame);
  EXPECT_LT(StripeColumn(frame, row - 44), bare - 18);
}

TEST(CameraView, ExposureFollowsTheMachine) {
  class Moving final : public MachineSource {
   public:
    MachineView At(double time_s) const override { return {10 * time_s, 0, 0, 10, true, false}; }
    std::shared_ptr<const Bed> bed(double) const override { return std::make_shared<Bed>(kBare); }
  };
  HeadEye eye = IdealEye();
  eye.dark.exposure_s = 0.02;
  const CameraView view(eye, Window(160, 120), Random(1));
  const CameraMoment moment = view.MomentAt(Moving(), 5);
  EXPECT_NEAR(moment.machine.x_mm, 50, 1e-9);
  EXPECT_NEAR(moment.travel_x_mm, 0.2, 1e-9);
  EXPECT_NEAR(view.MomentAt(Moving(), 5, 4).travel_x_mm, 0.05, 1e-9);
}

TEST(CameraView, DarkAndLitEyesDifferInLightAlone) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const HeadEye eye = DrawHeadEye({Plate::kMatte, Filament::kWhite, false}, Random(seed));
    EXPECT_EQ(eye.dark.px_per_mm, eye.lit.px_per_mm) << "seed " << seed;
    EXPECT_EQ(eye.dark.stripe_column_px, eye.lit.stripe_column_px) << "seed " << seed;
    EXPECT_EQ(eye.dark.position_error_mm, eye.lit.position_error_mm) << "seed " << seed;
    EXPECT_EQ(eye.dark.plate.peak, eye.lit.plate.peak) << "seed " << seed;
    EXPECT_LT(eye.dark.plate.ambient_bgr[1], eye.lit.plate.ambient_bgr[1]) << "seed " << seed;
  }
}

}  // namespace
}  // namespace trammel::sim

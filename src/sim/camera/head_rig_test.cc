#include "sim/camera/head_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <opencv2/core.hpp>

#include "sim/camera/camera_view.h"
#include "sim/laser/laser_test_support.h"
#include "support/temporary_folder.h"

namespace trammel::sim {
namespace {

bool Set(std::string_view name, double value, MountedRig& rig) {
  const auto set = SetNamed(kHeadRigNumbers, {name, value}, rig);
  return set && *set;
}

// The renderer's contract, 0.05 px, the eight-bit centroid's 0.01 and the cubic resampling's 0.02.
constexpr double kPositionTolerancePx = 0.08;
// A bead's centroid in a lit picture of 44 px/mm: its edges lie on cells of 0.025 mm, 1.1 px, and
// are read from the nearest one.
constexpr double kMarkTolerancePx = 1;
constexpr double kFocusMm = 17.86;
constexpr double kDegree = std::numbers::pi / 180;

HeadEye IdealEye() {
  HeadEye eye;
  eye.dark.plate.peak = 0.9;
  eye.dark.filament.peak = 0.9;
  eye.lit = eye.dark;
  eye.lit.plate.ambient_bgr = {20, 20, 20};
  eye.lit.filament.ambient_bgr = {200, 200, 200};
  return eye;
}

Frame Look(const MountedRig& rig, const CameraMoment& moment, int width = 1280, int height = 720) {
  CameraView view(IdealEye(), {rig.mount, width, height, rig.rig}, Random(1));
  Frame frame;
  view.Render(moment, frame);
  return frame;
}

CameraMoment HeadAt(double x_mm, double y_mm, double z_mm, Bed bed = {250, 250, {}}) {
  CameraMoment moment;
  moment.machine = {x_mm, y_mm, z_mm, 0, true, false};
  moment.bed = std::make_shared<Bed>(std::move(bed));
  return moment;
}

// A dot in the room's light: where the picture shows it.
PictureMap::Place MarkAt(const MountedRig& rig, const CameraMoment& moment) {
  CameraMoment lit = moment;
  lit.machine.laser_on = false;
  lit.machine.lights_on = true;
  const Frame frame = Look(rig, lit);
  double sum = 0;
  double x_sum = 0;
  double y_sum = 0;
  for (int y = 0; y < frame.height; ++y) {
    const std::uint8_t* row = frame.view().row(y);
    for (int x = 0; x < frame.width; ++x) {
      const double level = row[3 * x + 1];
      if (level < 90) continue;
      sum += level;
      x_sum += level * x;
      y_sum += level * y;
    }
  }
  return sum > 0 ? PictureMap::Place{x_sum / sum, y_sum / sum} : PictureMap::Place{-1, -1};
}

TEST(HeadRig, DefaultsShowWhatAViewWithoutThemShows) {
  const CameraMoment moment = HeadAt(72, 50, kFocusMm, StraightBead(90, 110, 100, 0.5, 0.2));
  CameraView plain(DrawHeadEye({}, Random(3)), {}, Random(1));
  CameraView rigged(DrawHeadEye({}, Random(3)), {{}, 1280, 720, HeadRig{}}, Random(1));
  Frame expected;
  Frame frame;
  plain.Render(moment, expected);
  CameraMoment settled = moment;
  rigged.Settle(settled);
  EXPECT_EQ(settled.machine.x_mm, moment.machine.x_mm);
  EXPECT_EQ(settled.bed, moment.bed);
  rigged.Render(settled, frame);
  EXPECT_EQ(frame.bgr, expected.bgr);
}

// By hand: a point right of the axis appears lower right to a camera turned counter-clockwise.
TEST(HeadRig, ACameraTurnedCounterClockwiseTurnsItsPictureClockwise) {
  HeadRig rig;
  rig.camera_turn_rad = 90 * kDegree;
  const auto down = MapOf(rig).Picture({740, 360});
  EXPECT_NEAR(down.x_px, 640, 1e-9);
  EXPECT_NEAR(down.y_px, 460, 1e-9);
  rig = {};
  rig.flip_x = true;
  const auto left = MapOf(rig).Picture({740, 380});
  EXPECT_NEAR(left.x_px, 540, 1e-9);
  EXPECT_NEAR(left.y_px, 380, 1e-9);
}

TEST(HeadRig, PictureAndUprightAreInverse) {
  for (const bool flip : {false, true}) {
    HeadRig rig;
    rig.camera_turn_rad = 0.7;
    rig.flip_x = flip;
    rig.flip_y = !flip;
    const PictureMap map = MapOf(rig);
    const auto back = map.Upright(map.Picture({100, 500}));
    EXPECT_NEAR(back.x_px, 100, 1e-9);
    EXPECT_NEAR(back.y_px, 500, 1e-9);
  }
}

TEST(HeadRig, StripeOfATurnedCameraLeansByTheTurn) {
  for (const double turn : {-3 * kDegree, 3 * kDegree}) {
    MountedRig rig;
    rig.rig.camera_turn_rad = turn;
    const Frame frame = Look(rig, HeadAt(72, 50, kFocusMm));
    // The stripe's column 872 is a vertical line 232 px from the axis; turned, column(row).
    for (const int row : {60, 360, 660}) {
      const double expected = 640 + 232 / std::cos(turn) - std::tan(turn) * (row - 360);
      EXPECT_NEAR(StripeColumn(frame, row), expected, kPositionTolerancePx) << row;
    }
  }
}

TEST(HeadRig, StripeFollowsTheBareBedAtEveryHeightScaleAndAngle) {
  for (const double angle_deg : {40.0, 45.0, 50.0}) {
    for (const double rise_mm : {-5.0, -1.0, 1.0, 5.0}) {
      MountedRig rig;
      ASSERT_TRUE(Set("laser-angle-deg", angle_deg, rig));
      ASSERT_TRUE(Set("scale", 1.1, rig));
      ASSERT_TRUE(Set("focus-height-mm", 18.9, rig));
      const Frame frame = Look(rig, HeadAt(72, 50, 18.9 + rise_mm), 1280, 64);
      const double from_axis_mm = (872 - 640) / 44.0 + rise_mm * std::tan(angle_deg * kDegree);
      const double expected = 640 + from_axis_mm * 1.1 * 44 * 34.5 / (34.5 + rise_mm);
      EXPECT_NEAR(StripeColumn(frame, 32), expected, 3 * kPositionTolerancePx)
          << angle_deg << " deg, " << rise_mm << " mm";
    }
  }
}

TEST(HeadRig, AMarkStandsWhereOffsetTurnScaleAndHeightSay) {
  const Bed dot = StraightBead(99.9, 100.1, 100, 0.8, 0.2);
  for (const double rise_mm : {-3.0, 0.0, 4.0}) {
    MountedRig rig;
    rig.mount.offset_x_mm = 31;
    rig.mount.offset_y_mm = 47;
    rig.rig.scale = 0.92;
    rig.rig.camera_turn_rad = 3 * kDegree;
    // The head stands so that the dot lies (2, 3) mm from the spot at the focus height.
    const auto place = MarkAt(rig, HeadAt(100 - 31 - 2, 100 - 47 - 3, kFocusMm + rise_mm, dot));
    const double axis_x_mm = (872 - 640) / 44.0;
    const double axis_y_mm = (371 - 360) / 44.0;  // the spot lies below the axis
    const double x_mm = axis_x_mm + 2;
    const double y_mm = -axis_y_mm + 3;
    const double scale = 0.92 * 44 * 34.5 / (34.5 + rise_mm);
    const double c = std::cos(3 * kDegree);
    const double s = std::sin(3 * kDegree);
    EXPECT_NEAR(place.x_px, 640 + scale * (c * x_mm + s * y_mm), kMarkTolerancePx) << rise_mm;
    EXPECT_NEAR(place.y_px, 360 - scale * (c * y_mm - s * x_mm), kMarkTolerancePx) << rise_mm;
  }
}

TEST(HeadRig, LaserAndRoomHaveTheirOwnBrightness) {
  MountedRig rig;
  ASSERT_TRUE(Set("laser-brightness", 0, rig));
  const auto brightest = [&](const CameraMoment& moment) {
    const Frame frame = Look(rig, moment, 160, 120);
    int red = 0;
    for (int row = 0; row < frame.height; ++row) red = std::max(red, RedPeak(frame, row));
    return red;
  };
  CameraMoment moment = HeadAt(72, 50, kFocusMm);
  EXPECT_LT(brightest(moment), 8);
  moment.machine.lights_on = true;
  EXPECT_NEAR(brightest(moment), 20, 8);
  ASSERT_TRUE(Set("room-brightness", 5, rig));
  EXPECT_NEAR(brightest(moment), 100, 12);
  ASSERT_TRUE(Set("laser-brightness", 10, rig));
  EXPECT_EQ(brightest(moment), 255);
}

TEST(HeadRig, BacklashLagsByHalfOnBothWays) {
  HeadRig rig;
  rig.backlash_mm = {0.2, 0, 0};
  RigMotion motion(rig, Random(1));
  const auto x_at = [&](double told) {
    MachineView machine;
    machine.x_mm = told;
    motion.Settle(machine);
    return machine.x_mm;
  };
  EXPECT_EQ(x_at(10), 10);
  EXPECT_NEAR(x_at(12), 11.9, 1e-12);
  EXPECT_NEAR(x_at(11.95), 11.9, 1e-12);  // within the slack
  EXPECT_NEAR(x_at(10), 10.1, 1e-12);
}

TEST(HeadRig, ABedIsLaidBehindTheSameBacklash) {
  HeadRig rig;
  rig.backlash_mm = {0.2, 0.1, 0};
  RigMotion motion(rig, Random(1));
  Bed bed = StraightBead(100, 120, 50, 0.5, 0.2);
  Strand back = StraightBead(100, 120, 60, 0.5, 0.2).strands[0];
  std::reverse(back.samples.begin(), back.samples.end());
  bed.strands.push_back(back);
  const auto told = std::make_shared<Bed>(bed);
  const auto laid = motion.Lay(told);
  EXPECT_NEAR(laid->strands[0].samples.back().x_mm, 119.9, 1e-12);
  EXPECT_NEAR(laid->strands[1].samples.back().x_mm, 100.1, 1e-12);
  EXPECT_NEAR(laid->strands[1].samples.back().y_mm, 59.95, 1e-12);
  EXPECT_EQ(motion.Lay(told), laid);
}

TEST(HeadRig, ALooseMountMovesOnReversalsAlone) {
  HeadRig rig;
  rig.mount_play_mm = 0.3;
  RigMotion motion(rig, Random(5));
  double before = 0;
  int changes = 0;
  const auto shift_at = [&](double told) {
    MachineView machine;
    machine.x_mm = told;
    motion.Settle(machine);
    EXPECT_LE(std::hypot(machine.x_mm - told, machine.y_mm), 0.3);
    if (machine.y_mm != before) ++changes;
    before = machine.y_mm;
  };
  for (int i = 0; i <= 20; ++i) shift_at(i);
  EXPECT_EQ(changes, 0);
  for (int i = 20; i >= 0; --i) shift_at(i);
  EXPECT_EQ(changes, 1);
  shift_at(5);
  EXPECT_EQ(changes, 2);
}

TEST(HeadRig, DrawnHeadsStayWithinWhatIsSaid) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const MountedRig rig = DrawHeadRig(Random(seed));
    EXPECT_LE(std::abs(rig.mount.offset_x_mm - 28), 4) << seed;
    EXPECT_LE(std::abs(rig.mount.focus_height_mm - 17.86), 1) << seed;
    EXPECT_LE(std::abs(rig.rig.camera_turn_rad), 3 * kDegree) << seed;
    EXPECT_LE(std::abs(rig.rig.scale - 1), 0.1) << seed;
  }
}

TEST(HeadRig, UnknownNamesAndWildNumbersAreRefused) {
  MountedRig rig;
  EXPECT_FALSE(Set("colour", 1, rig));
  EXPECT_FALSE(Set("scale", 3, rig));
  EXPECT_FALSE(Set("scale", std::nan(""), rig));
}

TEST(HeadRig, TruthSaysWhereTheSpotIsAndOverwritesNothing) {
  const test::TemporaryFolder folder;
  MountedRig rig;
  rig.rig.flip_x = true;
  const auto path = folder.path() / "rig.json";
  ASSERT_TRUE(WriteRigTruth(path, rig, IdealEye(), 7));
  const std::string text = test::ReadWhole(path);
  EXPECT_NE(text.find("\"spot_column_px\": 408.0000"), std::string::npos) << text;
  EXPECT_NE(text.find("\"seed\": 7"), std::string::npos);
  EXPECT_FALSE(WriteRigTruth(path, rig, IdealEye(), 7));
  EXPECT_EQ(test::ReadWhole(path), text);
}

}  // namespace
}  // namespace trammel::sim

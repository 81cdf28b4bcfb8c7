#include "sim/camera/head_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "sim/camera/camera_view.h"
#include "sim/laser/laser_test_support.h"

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

HeadOptics IdealLaserCamera() {
  HeadOptics optics;
  optics.dark.plate.peak = 0.9;
  optics.dark.filament.peak = 0.9;
  optics.lit = optics.dark;
  optics.lit.plate.ambient_bgr = {20, 20, 20};
  optics.lit.filament.ambient_bgr = {200, 200, 200};
  return optics;
}

Frame Look(const MountedRig& rig, const CameraMoment& moment, int width = 1280, int height = 720) {
  CameraView view(IdealLaserCamera(), {rig.mount, width, height, rig.rig}, Random(1));
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

// Derived by hand: a point right of the axis appears lower right to a camera turned
// counter-clockwise.
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

}  // namespace
}  // namespace trammel::sim

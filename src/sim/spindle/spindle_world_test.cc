#include "sim/spindle/spindle_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "base/statistics.h"

namespace trammel::sim {
namespace {

constexpr std::uint64_t kSeed = 61;  // development
constexpr double kRounding_px = 1e-9;

// Pin-hole of 1000 px at the taper's origin, no lens errors, nothing out of place.
SpindleSetup PlainSetup() {
  SpindleSetup setup;
  SpindleLens& lens = setup.lens;
  lens.pixel_pitch_mm = 0.01;
  lens.focal_length_mm = 10;
  lens.principal_offset_px = {0, 0};
  lens.k1 = lens.k2 = lens.p1 = lens.p2 = 0;
  lens.offset_mm = {0, 0, 0};
  lens.angles_rad = {0, 0, 0};
  setup.stated_lens = lens;
  setup.spread = {0, 0, 0};
  setup.part.misplaced_mm = setup.part.misplaced_rad = 0;
  setup.sigma_px = 0;
  return setup;
}

PixelPlace SeenFrom(const SpindleWorld& world, std::size_t stop = 0) {
  Random random(kSeed);
  const auto seen = Look(world, stop, 0, random);
  EXPECT_EQ(seen.size(), 1U);
  return seen.empty() ? PixelPlace{-1, -1} : seen.front().exact_px;
}

TEST(SpindleLens, BendsAsTheWrittenOutPolynomial) {
  const SpindleLens lens;
  const PixelPlace middle = PrincipalPx(lens);
  EXPECT_DOUBLE_EQ(middle[0], 1295.5 - 8.732);
  EXPECT_DOUBLE_EQ(middle[1], 971.5 + 27.52);
  // The polynomial at (1000, -700), worked out apart from this code.
  const auto direction = DirectionOf(lens, {middle[0] + 1000, middle[1] - 700});
  EXPECT_NEAR(direction[0] * 2813.181818181818, 1039.6618851, 1e-6);
  EXPECT_NEAR(direction[1] * 2813.181818181818, -727.32006841, 1e-6);
}

TEST(SpindleLens, SeesEveryPixelWhereItsObservationSays) {
  SpindleLens lens;
  for (const bool along_plus_z : {false, true}) {
    lens.along_plus_z = along_plus_z;
    for (double column = 0; column < lens.width_px; column += 323.7) {
      for (double row = 0; row < lens.height_px; row += 277.3) {
        const auto direction = DirectionOf(lens, {column, row});
        const double w = along_plus_z ? 240 : -240;
        const auto pixel = SeenAt(lens, {direction[0] * w, direction[1] * w, w});
        ASSERT_TRUE(pixel);
        EXPECT_NEAR((*pixel)[0], column, kRounding_px);
        EXPECT_NEAR((*pixel)[1], row, kRounding_px);
        EXPECT_FALSE(SeenAt(lens, {-direction[0] * w, -direction[1] * w, -w})) << "behind";
      }
    }
  }
}

TEST(SpindleLens, HasNoPlaceForWhatIsNotANumberOrBeyondTheFold) {
  SpindleLens lens;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(SeenAt(lens, {nan, 0, -1}));
  EXPECT_FALSE(SeenAt(lens, {0, 0, nan}));
  EXPECT_FALSE(SeenAt(lens, {1e9, 0, -1}));
  lens.k1 = -3e-7;  // folds at 1054 px, where it reaches 703 px
  lens.k2 = 0;
  EXPECT_FALSE(SeenAt(lens, {-1000 / FocalPx(lens), 0, -1}));
}

// Eq. 22: R_s = Rz(-angle), so the camera turns clockwise seen from above and a target at +x is
// seen at U = R_s^T (10, 0, -300) = (10 cos, 10 sin, -300).
TEST(SpindleWorld, ClampAngleTurnsTheCameraByMinusItself) {
  SpindleSetup setup = PlainSetup();
  setup.part.origin_mm = {510, 400, 100};
  setup.part.targets = {{}};
  setup.stops = {{{500, 400, 400}, 0}};
  SpindleWorld world = DrawSpindleWorld(setup, {kSeed, 0});
  world.clamping.angle_rad = 0.1;
  const PixelPlace seen = SeenFrom(world);
  EXPECT_NEAR(seen[0], 1295.5 - 1000 * 10 * std::cos(0.1) / 300, kRounding_px);
  EXPECT_NEAR(seen[1], 971.5 - 1000 * 10 * std::sin(0.1) / 300, kRounding_px);
}

TEST(SpindleWorld, EccentricityAndTiltSitBetweenSpindleAndTaper) {
  SpindleSetup setup = PlainSetup();
  setup.lens.offset_mm = {0, 0, -200};
  setup.part.origin_mm = {500, 400, 100};
  setup.part.targets = {{}};
  setup.stops = {{{500, 400, 600}, std::numbers::pi / 2}};
  SpindleWorld world = DrawSpindleWorld(setup, {kSeed, 0});
  world.clamping.eccentricity_mm = {0.3, 0};
  // C at 90 degrees carries the spindle's x to the machine's y: the camera is 0.3 mm too far in y
  // and sees the target 0.3 mm off in its own -x, 300 mm below.
  EXPECT_NEAR(SeenFrom(world)[0], 1295.5 + 1000 * 0.3 / 300, kRounding_px);
  EXPECT_NEAR(SeenFrom(world)[1], 971.5, kRounding_px);
  world.clamping.eccentricity_mm = {0, 0};
  world.clamping.tilt_rad = {0.01, 0};
  // Rx(0.01) turns the axis by 0.01: 500 mm below, the target is 5 mm · (cos, sin) off the axis.
  const double u_v_w_v = 500 * std::sin(0.01);
  const double w = -500 * std::cos(0.01) + 200;
  EXPECT_NEAR(SeenFrom(world)[1], 971.5 + 1000 * -u_v_w_v / w, kRounding_px);
}

TEST(SpindleWorld, PartTurnsAboutXThenYThenZ) {
  SpindleSetup setup = PlainSetup();
  setup.part.angles_rad = {0.2, -0.3, 0.4};
  setup.part.targets = {{1, {10, 20, 30}}};
  const SpindleWorld world = DrawSpindleWorld(setup, {kSeed, 0});
  // Written out: about x, then the fixed y, then the fixed z.
  double x = 10;
  double y = 20 * std::cos(0.2) - 30 * std::sin(0.2);
  double z = 20 * std::sin(0.2) + 30 * std::cos(0.2);
  const double x1 = x * std::cos(-0.3) + z * std::sin(-0.3);
  z = -x * std::sin(-0.3) + z * std::cos(-0.3);
  x = x1 * std::cos(0.4) - y * std::sin(0.4);
  y = x1 * std::sin(0.4) + y * std::cos(0.4);
  const Triple at = world.machine_from_part.Out(world.targets_mm[0]);
  EXPECT_NEAR(at[0], x, 1e-12);
  EXPECT_NEAR(at[1], y, 1e-12);
  EXPECT_NEAR(at[2], z, 1e-12);
}

// Three targets that go round counter-clockwise for whoever looks at them. Twice the area of their
// pictures' triangle, with rows that run down, is negative for counter-clockwise.
double TwiceArea(const SpindleLens& lens) {
  SpindleSetup setup = PlainSetup();
  setup.lens = lens;
  setup.part.origin_mm = {500, 400, 100};
  setup.part.targets = {{1, {0, 0, 0}}, {2, {20, 0, 0}}, {3, {0, 20, 0}}};
  setup.stops = {{{500, 400, 720}, 0}};
  Random random(kSeed);
  const auto seen = Look(DrawSpindleWorld(setup, {kSeed, 0}), 0, 0, random);
  EXPECT_EQ(seen.size(), 3U);
  const PixelPlace a = seen[0].exact_px;
  const PixelPlace b = seen[1].exact_px;
  const PixelPlace c = seen[2].exact_px;
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

TEST(SpindleWorld, OnlyTheCameraAlongPlusZTakesPicturesThatAreNotMirrored) {
  EXPECT_GT(TwiceArea(SpindleLens{}), 0) << "Table 1 with rows that run down: a mirror image";
  EXPECT_LT(TwiceArea(AsRealCamera(SpindleLens{})), 0);
}

TEST(SpindleWorld, RealCameraStandsWhereTheOtherStood) {
  const SpindleLens lens;
  const SpindleLens real = AsRealCamera(lens);
  const Triple seen = {0.3, -0.2, 1};
  const Triple a = TurnOf(real.angles_rad) * seen;
  const Triple b = TurnOf(lens.angles_rad) * Triple{seen[0], -seen[1], -seen[2]};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-14);
}

TEST(SpindleWorld, MachineErrorsMoveTheSpindleNotWhatIsStated) {
  SpindleSetup setup = PlainSetup();
  setup.machine.scale = {1e-4, 0, -1e-4};
  setup.machine.square_xy_rad = 5e-5;
  setup.machine.square_xz_rad = 3e-5;
  setup.machine.square_yz_rad = -2e-5;
  setup.stops = {{{1000, 800, 500}, 0}};
  const SpindleWorld world = DrawSpindleWorld(setup, {kSeed, 0});
  EXPECT_NEAR(world.actual_mm[0][0], 1000.1 + 0.04 + 0.015, 1e-9);
  EXPECT_NEAR(world.actual_mm[0][1], 800 - 0.01, 1e-9);
  EXPECT_NEAR(world.actual_mm[0][2], 500 - 0.05, 1e-9);
}

TEST(SpindleWorld, WarmthAndScaleBarStretchThePart) {
  SpindleSetup setup = PlainSetup();
  setup.part.targets = {{1, {1000, 0, 0}}};
  setup.part.temperature_c = 21;
  setup.part.out_of_machine_scale = 2e-5;
  const SpindleWorld world = DrawSpindleWorld(setup, {kSeed, 0});
  EXPECT_NEAR(world.targets_mm[0][0], 1000 + 0.011 - 0.02, 1e-6);
}

TEST(SpindleWorld, ClampingsScatterAsSet) {
  const SpindleSetup setup = LaboratoryScene(300);
  std::vector<double> angle;
  std::vector<double> x;
  constexpr int kClampings = 4000;
  for (std::uint64_t i = 0; i < kClampings; ++i) {
    const SpindleWorld world = DrawSpindleWorld(setup, {kSeed, i});
    EXPECT_LE(std::abs(world.clamping.angle_rad), 3.3e-3);
    angle.push_back(world.clamping.angle_rad);
    x.push_back(world.clamping.eccentricity_mm[0]);
  }
  // Four standard errors of a standard deviation: of a uniform 0.45 / sqrt(n) of it, of a normal
  // one 0.71 / sqrt(n).
  EXPECT_NEAR(StandardDeviation(angle), 3.3e-3 / std::sqrt(3), 3.3e-3 / std::sqrt(3) * 0.03);
  EXPECT_NEAR(StandardDeviation(x), 0.015, 0.015 * 0.045);
}

TEST(SpindleWorld, OneSeedIsOnePartAndEachClampingItsOwn) {
  const SpindleSetup setup = LaboratoryScene(300);
  const SpindleWorld a = DrawSpindleWorld(setup, {kSeed, 0});
  const SpindleWorld b = DrawSpindleWorld(setup, {kSeed, 1});
  const SpindleWorld c = DrawSpindleWorld(setup, {kSeed + 1, 0});
  EXPECT_EQ(a.machine_from_part.origin_mm, b.machine_from_part.origin_mm);
  EXPECT_NE(a.clamping.angle_rad, b.clamping.angle_rad);
  EXPECT_NE(a.machine_from_part.origin_mm, c.machine_from_part.origin_mm);
}

TEST(SpindleScene, EveryStopSeesItsOwnTargetWithRoomForItsRing) {
  for (const SpindleSetup& setup :
       {LaboratoryScene(300), LaboratoryScene(150), IndustryScene(150), IndustryScene(300)}) {
    ASSERT_TRUE(Validate(setup)) << Validate(setup).error().message;
    const SpindleWorld world = DrawSpindleWorld(setup, {kSeed, 0});
    for (std::size_t stop = 0; stop < setup.stops.size(); ++stop) {
      Random random(kSeed);
      const auto seen = Look(world, stop, 60, random);
      ASSERT_EQ(seen.size(), 1U) << "stop " << stop;
      EXPECT_EQ(seen[0].target, stop / 2);
    }
  }
}

TEST(SpindleSetup, IsRefusedByName) {
  using ::testing::HasSubstr;
  SpindleSetup setup = LaboratoryScene(300);
  setup.stops[2].stated_mm[2] = 2000;
  EXPECT_THAT(Validate(setup).error().message, HasSubstr("stop 3 has Z 2000 mm"));
  setup = LaboratoryScene(300);
  setup.sigma_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Validate(setup).error().message, HasSubstr("sigma_px"));
  setup = LaboratoryScene(300);
  setup.lens.focal_length_mm = 0;
  EXPECT_THAT(Validate(setup).error().message, HasSubstr("focal_length_mm"));
}

}  // namespace
}  // namespace trammel::sim

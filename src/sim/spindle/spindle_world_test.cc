#include "sim/spindle/spindle_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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

TEST(SpindleSetup, WithAStopBeyondTheTravelIsRefused) {
  using ::testing::HasSubstr;
  SpindleSetup setup = LaboratoryScene(300);
  setup.stops[2].stated_mm[2] = 2000;
  EXPECT_THAT(Validate(setup).error().message, HasSubstr("stop 3 has Z 2000 mm"));
}

}  // namespace
}  // namespace trammel::sim

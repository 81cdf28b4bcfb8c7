#include "pressure_advance/setup/solve_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/setup/camera_scale.h"
#include "pressure_advance/setup/setup_world_test_support.h"
#include "pressure_advance/setup/stripe_reading.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kRad;
using testing::SetupWorld;

SetupWorld Usual() {
  SetupWorld world;
  world.repeat_mm = 0.004;
  world.noise_px = 0.1;
  return world;
}

SetupObservations Look(const SetupWorld& world, std::uint64_t seed = 1) {
  Random random(seed);
  SetupObservations seen;
  for (const SeenStripe& stripe : world.Stripes(14, 17, random)) {
    StripeReading reading;
    reading.across_px = stripe.across_px;
    reading.width_px = stripe.width_px;
    reading.peak = 200;
    reading.slope = -std::tan(world.turn_rad);  // a sheet along y, in a turned picture
    seen.stripes.push_back({stripe.head, reading});
  }
  seen.height_mm = world.focus_mm;
  seen.marks = world.Marks(random);
  seen.mark_x_mm = world.mark_x_mm, seen.mark_y_mm = world.mark_y_mm;
  seen.picture = {1280, 720};
  return seen;
}

TEST(SolveSetup, FindsTheWorldBehindTheReadings) {
  SetupWorld world = Usual();
  world.turn_rad = 2 * kRad;
  const SetupResult result = SolveSetup(Look(world));
  ASSERT_EQ(result.verdict(), Verdict::kGood) << result.reason();
  EXPECT_NEAR(result.focus_mm.quantity().value, world.focus_mm, 0.05);
  EXPECT_NEAR(result.scale.px_per_mm.quantity().value, 40, 0.4);
  EXPECT_NEAR(result.laser_turn_rad.quantity().value, 0, 0.1 * kRad);
  // The stripe moves to larger columns where the head rises: to smaller ones where a bead does.
  EXPECT_LT(world.SeeStripe({0, 0, 18, 1, 1, 1}, *std::make_unique<Random>(1)).across_px,
            world.SeeStripe({0, 0, 17, 1, 1, 1}, *std::make_unique<Random>(1)).across_px);
  EXPECT_EQ(result.height_direction, AxisDirection::kPlusX);
  const double shift = result.height.px_per_height_mm.quantity().value;
  EXPECT_NEAR(std::tan(result.scan_angle_rad.quantity().value) * 40, std::abs(shift), 0.4);
}

TEST(SolveSetup, PlacesTheSpotSoThatTheHeadComesThere) {
  SetupWorld world = Usual();
  world.turn_rad = -3 * kRad;
  const SetupResult result = SolveSetup(Look(world));
  ASSERT_EQ(result.verdict(), Verdict::kGood) << result.reason();
  // With the head moved by the offset, the mark is at the spot.
  Random random(1);
  world.noise_px = world.repeat_mm = 0;
  const SeenMark mark =
      world.See({world.mark_x_mm - result.offset.x_mm.quantity().value,
                 world.mark_y_mm - result.offset.y_mm.quantity().value, world.focus_mm, 1, 1, 1},
                random);
  constexpr double kNoise_px = 1;  // 0.025 mm
  EXPECT_NEAR(mark.column_px, result.spot_column_px, kNoise_px);
  EXPECT_NEAR(mark.row_px, result.spot_row_px, kNoise_px);
}

TEST(SolveSetup, CarriesTheReasonOfAMarkThatIsNotSeen) {
  SetupObservations seen = Look(Usual());
  seen.marks.clear();
  seen.mark_fault = "the picture is too dark";
  const SetupResult result = SolveSetup(seen);
  EXPECT_EQ(result.verdict(), Verdict::kRefused);
  EXPECT_THAT(result.reason(), HasSubstr("too dark"));
  EXPECT_TRUE(result.focus_mm.good());
}

TEST(CheckSpot, TakesAnOffsetBackThatDoesNotBringTheMarkThere) {
  SetupResult result = SolveSetup(Look(Usual()));
  MarkReading mark;
  mark.column_px = result.spot_column_px + 0.5, mark.row_px = result.spot_row_px;
  CheckSpot(mark, result);
  EXPECT_EQ(result.verdict(), Verdict::kGood);
  EXPECT_NEAR(result.check_mm.value_or(9), 0.0125, 0.001);
  mark.column_px += 20;
  CheckSpot(mark, result);
  EXPECT_EQ(result.verdict(), Verdict::kCannotTell);
  EXPECT_THAT(result.reason(), HasSubstr("beside it"));
}

constexpr double kLowest_mm = 14;  // 3.9 mm below the usual focus height …
constexpr int kSteps = 17;         // … to 4.1 mm above

struct Found {
  CameraScale scale;
  CameraOffset offset;
  Measured focus;
  StripeHeight height;
};

Measured FocusOf(std::span<const SeenStripe> stripes) {
  const double middle_mm =
      0.5 * (stripes.front().head.z_mm + stripes[stripes.size() / 2].head.z_mm);
  const StripeHeight way = FitStripeHeight(stripes, middle_mm, Measured());
  return FitFocusHeight(stripes, way.perspective.value_or(Perspective{}));
}

// The picture's middle is the pixel asked for: its truth is the optical axis itself.
Found Measure(const SetupWorld& world, std::uint64_t seed) {
  Random random(seed);
  Found found;
  found.scale = FitCameraScale(world.Marks(random));
  found.offset = FindCameraOffset(
      found.scale, {world.mark_x_mm, world.mark_y_mm, 0.01, 640, 360, world.noise_px});
  const auto stripes = world.Stripes(kLowest_mm, kSteps, random);
  found.focus = FocusOf(stripes);
  found.height = FitStripeHeight(stripes, world.focus_mm, found.scale.px_per_mm);
  return found;
}

double PxPerHeight(const SetupWorld& world) {  // pinhole's, by a small difference
  constexpr double kStep_mm = 1e-4;
  const auto at = [&world](double z) {
    return world.Scale(world.focus_mm + z) * (world.spot_mm - std::tan(world.laser_angle_rad) * z);
  };
  return (at(kStep_mm) - at(-kStep_mm)) / (2 * kStep_mm);
}

struct Tally {
  const char* name;
  double bound;
  int good = 0, covered = 0;
  double worst = 0;
  std::vector<double> errors = {};
  void Add(const Measured& measured, double truth) {
    if (!measured.good()) return;
    const Quantity& quantity = measured.quantity();
    ++good;
    covered += quantity.interval95.lo <= truth && truth <= quantity.interval95.hi ? 1 : 0;
    worst = std::max(worst, std::abs(quantity.value - truth));
    errors.push_back(std::abs(quantity.value - truth));
  }
};

// Draws errors of a mounted camera: 3 degrees, 4 mm, 1 mm of focus, 10 % of scale, and more beyond.
SetupWorld Draw(std::uint64_t seed, double factor) {
  Random random(seed);
  SetupWorld world = Usual();
  world.turn_rad = factor * random.Uniform(-3, 3) * kRad;
  world.axis_x_mm += factor * random.Uniform(-4, 4);
  world.axis_y_mm += factor * random.Uniform(-4, 4);
  world.focus_mm += factor * random.Uniform(-1, 1);
  world.px_per_mm *= 1 + factor * random.Uniform(-0.1, 0.1);
  world.laser_angle_rad += factor * random.Uniform(-3, 3) * kRad;
  constexpr double kAxis = 0.001;      // as kAxisScaleUncertainty
  constexpr double kPrincipal_px = 8;  // like FitStripeHeight
  for (double& error : world.axis_error) error = kAxis * random.Normal();
  world.principal_px = kPrincipal_px * random.Normal();
  return world;
}

// TRAMMEL_SETUP_WORLDS=1000 for the figures of the manual.
int Worlds() {
  const char* asked = std::getenv("TRAMMEL_SETUP_WORLDS");
  return asked != nullptr ? std::atoi(asked) : 200;
}

void ExpectRight(double factor) {
  const int worlds = Worlds();
  Tally scale{"scale", 0.01}, turn{"rotation", 0.3 * kRad}, x{"offset x", 0.05},
      y{"offset y", 0.05}, focus{"focus", 0.2}, angle{"angle", 0.3 * kRad}, height{"height", 0.01};
  for (std::uint64_t seed = 1000; seed < 1000 + static_cast<std::uint64_t>(worlds); ++seed) {
    const SetupWorld world = Draw(seed, factor);
    const Found found = Measure(world, seed + 100000);
    scale.Add(found.scale.px_per_mm, world.px_per_mm);
    turn.Add(found.scale.rotation_rad, world.turn_rad);
    // Commanded millimetres are what moves the head there.
    x.Add(found.offset.x_mm, world.axis_x_mm / (1 + world.axis_error[0]));
    y.Add(found.offset.y_mm, world.axis_y_mm / (1 + world.axis_error[1]));
    focus.Add(found.focus, world.focus_mm);
    angle.Add(found.height.laser_angle_rad, world.laser_angle_rad);
    height.Add(found.height.px_per_height_mm, PxPerHeight(world));
  }
  // The optical axis' own error is normal: no bound holds its worst.
  angle.worst = Quantile(angle.errors, 0.95);
  scale.worst /= 40 * (1 - 0.1 * factor), height.worst /= 35 * (1 - 0.1 * factor);
  const double min_covered = 0.95 - 3 * std::sqrt(0.95 * 0.05 / worlds);
  constexpr double kMinGood = 0.999;
  for (const Tally* tally : {&scale, &turn, &x, &y, &focus, &angle, &height}) {
    EXPECT_GE(tally->good, kMinGood * worlds) << tally->name;
    EXPECT_GE(tally->covered, min_covered * tally->good) << tally->name;
    EXPECT_LE(tally->worst, tally->bound) << tally->name;
    std::printf("%-9s good %4d covered %4d worst %.5f of %.5f\n", tally->name, tally->good,
                tally->covered, tally->worst, tally->bound);
  }
}

TEST(Setup, IsRightAndCoversForCamerasMountedByHand) { ExpectRight(1); }
TEST(Setup, IsRightAndCoversThreeTimesBeyond) { ExpectRight(3); }

TEST(AdviseSetup, NamesExposureCropAndASheetThatIsAskew) {
  constexpr PictureSize kPicture{1280, 720};
  const auto lines = [&](const SetupResult& result) { return AdviseSetup(result, kPicture).lines; };
  SetupResult result;
  EXPECT_THAT(lines(result), IsEmpty());
  EXPECT_FALSE(AdviseSetup(result, kPicture).threshold);
  result.exposure = Exposure{180, 10, 0, 8};
  EXPECT_THAT(lines(result), Contains(HasSubstr("well exposed")));
  EXPECT_EQ(AdviseSetup(result, kPicture).threshold, 100);  // half of the stripe over the plate
  result.exposure = Exposure{240, 10, 3, 8};
  EXPECT_THAT(lines(result), Contains(HasSubstr("shorten")));
  result.exposure = Exposure{30, 10, 0, 8};
  EXPECT_THAT(lines(result), Contains(HasSubstr("lengthen")));
  result.crop = PixelRect{1200, 300, 80, 100};
  EXPECT_THAT(lines(result), Contains(HasSubstr("picture's edge")));
  for (const double turn_rad : {0.06, 0.06 + 1.5707963, -0.06}) {
    result.laser_turn_rad = Measured::Good({turn_rad, 0.001, {turn_rad - 0.002, turn_rad + 0.002}});
    EXPECT_THAT(lines(result), Contains(HasSubstr("3.4 degrees"))) << turn_rad;
  }
}

TEST(CameraScale, RefusesMarksThatNoHeadMovesSo) {
  Random random(5);
  const auto marks = Usual().Marks(random);
  const auto reason = [&](const std::function<void(SeenMark&)>& spoil) {
    auto spoilt = marks;
    for (SeenMark& mark : spoilt) spoil(mark);
    return FitCameraScale(spoilt).px_per_mm.reason();
  };
  EXPECT_THAT(reason([](SeenMark& mark) { mark.column_px = -mark.column_px; }),
              HasSubstr("mirrored"));
  EXPECT_THAT(reason([&](SeenMark& mark) {
                mark.column_px = 300 + random.Normal(), mark.row_px = random.Normal();
              }),
              HasSubstr("not printed"));
  EXPECT_THAT(reason([](SeenMark& mark) { mark.head.x_mm *= 1.05; }), HasSubstr("steps per mm"));
  EXPECT_NE(reason([](SeenMark& mark) { mark.head.y_mm = 100; }), "");
  EXPECT_EQ(FitCameraScale({}).px_per_mm.verdict(), Verdict::kCannotTell);
}

TEST(Setup, NamesALooseMountAndPlay) {
  SetupWorld loose = Usual();
  loose.repeat_mm = 0.2;
  EXPECT_THAT(Measure(loose, 1).scale.px_per_mm.reason(), HasSubstr("mount"));
  EXPECT_THAT(Measure(loose, 1).height.px_per_height_mm.reason(), HasSubstr("mount"));
  SetupWorld backlash = Usual();
  backlash.backlash_y_mm = backlash.backlash_z_mm = 0.3;
  EXPECT_THAT(Measure(backlash, 1).scale.px_per_mm.reason(), HasSubstr("two sides in y"));
  EXPECT_THAT(Measure(backlash, 1).height.px_per_height_mm.reason(), HasSubstr("from below"));
}

TEST(FocusHeight, SaysOnWhichSideToLook) {
  for (const double focus_mm : {8.0, 28.0}) {
    SetupWorld world = Usual();
    world.focus_mm = focus_mm;
    Random random(5);
    const Measured focus = FocusOf(world.Stripes(kLowest_mm, kSteps, random));
    EXPECT_EQ(focus.verdict(), Verdict::kCannotTell);
    EXPECT_THAT(focus.reason(), HasSubstr("look"));
  }
}

// A glossy plate: the parabola is not the widths' own law, and the narrowest stripe is what counts.
TEST(FocusHeight, CoversWidthsThatAreNoParabola) {
  int good = 0, covered = 0, worlds = 0;
  for (std::uint64_t seed = 5000; seed < 5200; ++seed, ++worlds) {
    Random random(seed);
    SetupWorld world = Draw(seed, 1);
    world.skew = 0.02 * random.Normal();
    world.halo = random.Uniform(0, 0.4);
    const double from_mm = world.focus_mm - 3 - random.Uniform(0, 1);
    const Measured focus = FocusOf(world.Stripes(from_mm, 15, random));
    // d/dz of (sharpest² + (spread · z)²) · exp(2 skew z) is 0.
    constexpr double kRatio = 2.5 * 2.5 / (1.2 * 1.2);
    const double narrowest_mm =
        world.focus_mm -
        2 * world.skew * kRatio / (1 + std::sqrt(1 - 4 * world.skew * world.skew * kRatio));
    if (!focus.good()) continue;
    ++good;
    const auto& interval = focus.quantity().interval95;
    covered += interval.lo <= narrowest_mm && narrowest_mm <= interval.hi ? 1 : 0;
  }
  EXPECT_GE(good, 0.8 * worlds);
  EXPECT_GE(covered, 0.9 * good) << good;
  std::printf("focus without a parabola: %d of %d covered\n", covered, good);
}

}  // namespace
}  // namespace trammel::pressure_advance

#include "pressure_advance/setup/solve_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "pressure_advance/setup/setup_world_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;
using testing::kRad;
using testing::SetupWorld;

constexpr SetupLimits kLimits;

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
  const SetupResult result = SolveSetup(Look(world), kLimits);
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
  const SetupResult result = SolveSetup(Look(world), kLimits);
  ASSERT_EQ(result.verdict(), Verdict::kGood) << result.reason();
  // With the head moved by the offset the mark stands at the spot.
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

TEST(SolveSetup, CropsRoundTheSpotWithRoomOnTheSideOfRisingBeads) {
  const SetupResult result = SolveSetup(Look(Usual()), kLimits);
  ASSERT_TRUE(result.crop.has_value());
  const double right = result.crop->x + result.crop->width - 1 - result.spot_column_px;
  const double left = result.spot_column_px - result.crop->x;
  EXPECT_GT(right, left + 10);  // height_direction is +x here
  EXPECT_NEAR(result.crop->y + 0.5 * (result.crop->height - 1), result.spot_row_px, 1);
  EXPECT_GE(result.crop->height, 5 * 0.495 * 40);
}

TEST(SolveSetup, CarriesTheReasonOfStripesThatAreNotSeen) {
  SetupObservations seen = Look(Usual());
  for (PlacedStripe& stripe : seen.stripes) stripe.reading = {.fault = "no laser stripe (1)"};
  seen.marks.clear();
  seen.mark_fault = "not looked at";
  const SetupResult result = SolveSetup(seen, kLimits);
  EXPECT_EQ(result.verdict(), Verdict::kRefused);
  EXPECT_THAT(result.reason(), HasSubstr("no laser stripe"));
  EXPECT_FALSE(result.crop.has_value());
}

TEST(SolveSetup, CarriesTheReasonOfAMarkThatIsNotSeen) {
  SetupObservations seen = Look(Usual());
  seen.marks.clear();
  seen.mark_fault = "the picture is too dark";
  const SetupResult result = SolveSetup(seen, kLimits);
  EXPECT_EQ(result.verdict(), Verdict::kRefused);
  EXPECT_THAT(result.reason(), HasSubstr("too dark"));
  EXPECT_TRUE(result.focus_mm.good());
}

TEST(SolveSetup, BearsPicturesWithoutAStripe) {
  SetupObservations seen = Look(Usual());
  for (std::size_t i = 0; i < seen.stripes.size(); i += 3) {
    seen.stripes[i].reading = {.fault = "overexposed"};
  }
  EXPECT_EQ(SolveSetup(seen, kLimits).verdict(), Verdict::kGood);
}

TEST(SolveSetup, NamesAMirroredPicture) {
  SetupWorld world = Usual();
  world.mirror = -1;
  const SetupResult result = SolveSetup(Look(world), kLimits);
  EXPECT_EQ(result.verdict(), Verdict::kRefused);
  EXPECT_THAT(result.reason(), HasSubstr("mirrored"));
}

TEST(SolveSweep, SaysWhereTheStripeIsSharpest) {
  SetupWorld world = Usual();
  world.focus_mm = 25;
  const StripeSweep sweep = SolveSweep(Look(world).stripes, kLimits);
  EXPECT_FALSE(sweep.focus_mm.good());
  ASSERT_TRUE(sweep.sharpest_mm.has_value());
  EXPECT_GT(*sweep.sharpest_mm, 20);
}

TEST(CheckSpot, TakesAnOffsetBackThatDoesNotBringTheMarkThere) {
  SetupResult result = SolveSetup(Look(Usual()), kLimits);
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

TEST(CheckSpot, TakesAnOffsetBackWhereNoMarkIs) {
  SetupResult result = SolveSetup(Look(Usual()), kLimits);
  MarkReading mark;
  mark.fault = "no square";
  CheckSpot(mark, result);
  EXPECT_THAT(result.reason(), HasSubstr("no square"));
}

}  // namespace
}  // namespace trammel::pressure_advance

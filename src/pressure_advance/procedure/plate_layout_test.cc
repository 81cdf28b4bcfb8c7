#include "pressure_advance/procedure/plate_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using settings::ScanSettings;
using ::testing::HasSubstr;

const Reach kReach{{0, 0, 0}, {250, 250, 250}};

PatternConfig One() {
  PatternConfig one;
  one.material = "pla";
  return one;
}

bool Touch(const pressure_advance::BoundsMm& a, const pressure_advance::BoundsMm& b) {
  return a.min_x_mm < b.max_x_mm && b.min_x_mm < a.max_x_mm && a.min_y_mm < b.max_y_mm &&
         b.min_y_mm < a.max_y_mm;
}

TEST(PlateLayout, LaysAsManyPatternsAsAreWantedApartAndWithinReach) {
  for (int count = kFewestPatterns; count <= kMaxPatterns; ++count) {
    const auto laid = PatternsBeside(One(), count, {}, kReach);
    ASSERT_TRUE(laid.has_value()) << count << ": " << laid.error().message;
    ASSERT_TRUE(Validate(*laid)) << count;
    const auto layout = LayOut(*laid);
    ASSERT_EQ(layout.patterns.size(), static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < layout.patterns.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        EXPECT_FALSE(Touch(layout.patterns[i], layout.patterns[k])) << count;
      }
    }
    const auto sweeps = PlanSweeps(MakePlan(layout, *laid, ""), {}, {}, kReach);
    ASSERT_TRUE(sweeps.has_value()) << sweeps.error().message;
    std::set<int> swept;
    for (const Sweep& sweep : sweeps->sweeps) swept.insert(sweep.pattern);
    EXPECT_EQ(swept.size(), static_cast<std::size_t>(count));
  }
}

// The middle of the bed is as good as any place, but not where the camera stands beside the nozzle.
TEST(PlateLayout, MovesAsidePatternsThatTheCameraReachesElsewhereAlone) {
  PatternConfig one = One();
  ScanSettings scan;
  scan.camera_offset_x_mm = 90;
  scan.camera_offset_y_mm = 0;
  const auto laid = PatternsBeside(one, 3, scan, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  const auto alone = PatternsBeside(one, 3, {}, kReach);
  ASSERT_TRUE(alone.has_value());
  EXPECT_GT(LayOut(*laid).printed.min_x_mm, LayOut(*alone).printed.min_x_mm);
  EXPECT_TRUE(PlanSweeps(MakePlan(LayOut(*laid), *laid, ""), {}, scan, kReach).has_value());
}

TEST(PlateLayout, KeepsThePlaceThatTheSettingsName) {
  PatternConfig one = One();
  one.position_x_mm = 60;
  one.position_y_mm = 80;
  const auto laid = PatternsBeside(one, 4, {}, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  EXPECT_EQ(laid->position_x_mm, 60);
  EXPECT_EQ(laid->position_y_mm, 80);
  one.position_x_mm = 230;
  EXPECT_FALSE(PatternsBeside(one, 4, {}, kReach).has_value());
}

TEST(PlateLayout, SaysHowManyFit) {
  const Reach small{{0, 0, 0}, {140, 140, 250}};
  const auto laid = PatternsBeside(One(), 9, {}, small);
  ASSERT_FALSE(laid.has_value());
  EXPECT_EQ(laid.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(laid.error().message, HasSubstr("with --repeat"));
  const auto none = PatternsBeside(One(), 2, {}, {{0, 0, 0}, {60, 60, 250}});
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message, HasSubstr("nor does one"));
}

constexpr double kExact = 1e-9;

TEST(PlacedSweep, MovesBecomePositionsOfTheLaserOnTheHostsClock) {
  Sweep sweep;
  sweep.along_x = -1;  // printed towards -x
  sweep.along_y = 0;
  sweep.start_x_mm = 99;
  sweep.end_x_mm = 70;
  sweep.origin_mm = -100;  // the laser stands at the line's start where the nozzle is at x = 100
  machine::ClockRelation clock;
  clock.print_from_host = {1000, 50, 1, 0, 0};  // print time 50 is 1000 s of ours
  const std::vector<machine::TrapezoidMove> moves = {
      {52, 0.5, 4, 10, {98, 20, 17.86}, {-1, 0, 0}},
      {53, 0.5, 5, 0, {98, 20, 17.86}, {0, 0, 1}},   // z move: nothing along the line
      {54, 0.0, 5, 0, {98, 20, 17.86}, {-1, 0, 0}},  // zero duration
  };
  const auto along = AlongLine(moves, {&sweep, 1}, clock, {});
  ASSERT_EQ(along.size(), 1u);
  EXPECT_NEAR(along[0].start_s, 1002, kExact);
  EXPECT_NEAR(along[0].start_mm, 2, kExact);
  EXPECT_NEAR(along[0].start_speed_mm_s, 4, kExact);
  EXPECT_NEAR(along[0].acceleration_mm_s2, 10, kExact);
}

// A line was printed in G-code's coordinates and is swept in them; the firmware tells its own.
TEST(PlacedSweep, AGcodeOffsetIsNotTakenForAPlaceOnTheLine) {
  Sweep sweep;
  sweep.end_x_mm = 30;
  machine::ClockRelation clock;
  const std::vector<machine::TrapezoidMove> moves = {{1, 0.5, 4, 0, {12.3, 7, 0}, {1, 0, 0}}};
  const auto along = AlongLine(moves, {&sweep, 1}, clock, {0.3, -0.1, 0.02});
  ASSERT_EQ(along.size(), 1u);
  EXPECT_NEAR(along[0].start_mm, 12, kExact);
}

TEST(PlacedSweep, IsWholeWhereTheMovesLeadFromItsBeginToAStandAtItsEnd) {
  Sweep sweep;
  sweep.start_x_mm = 10;
  sweep.end_x_mm = 40;
  auto moves = pressure_advance::TrapezoidSweep(100, 10, 40, 10, 1000);
  const std::span<const Sweep> run(&sweep, 1);
  EXPECT_TRUE(IsWhole(moves, run));
  EXPECT_FALSE(IsWhole(std::span(moves).first(moves.size() - 1), run));  // the end is to come
  EXPECT_FALSE(IsWhole(std::span(moves).subspan(1), run));
  EXPECT_FALSE(IsWhole({}, run));
  moves.erase(moves.begin() + 1);  // a batch got lost
  EXPECT_FALSE(IsWhole(moves, run));
}

TEST(PlacedSweep, APictureThatIsNoneIsAnErrorAndNotABlackFrame) {
  machine::CapturedFrame frame;
  frame.image = {1, 2, 3};
  EXPECT_FALSE(Observe(std::vector{frame}, {}).has_value());
  EXPECT_FALSE(Reddened(frame, frame).has_value());
}

}  // namespace
}  // namespace trammel::procedure

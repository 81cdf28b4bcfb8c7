#include "pressure_advance/procedure/plate_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_plan.h"

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
  for (int count = kFewestPatterns; count <= kMostPatterns; ++count) {
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

TEST(PlateLayout, LeavesAGridOfTheSettingsAlone) {
  PatternConfig one = One();
  one.columns = 2;
  const auto laid = PatternsBeside(one, 3, {}, kReach);
  ASSERT_FALSE(laid.has_value());
  EXPECT_EQ(laid.error().kind, ErrorKind::kInput);
  EXPECT_THAT(laid.error().message, HasSubstr("columns"));
}

TEST(PlateLayout, SaysWhatIsWrongWithTheScanItself) {
  ScanSettings scan;
  scan.skip_mm = 500;
  const auto laid = PatternsBeside(One(), 2, scan, kReach);
  ASSERT_FALSE(laid.has_value());
  EXPECT_THAT(laid.error().message, HasSubstr("skip"));
}

}  // namespace
}  // namespace trammel::procedure

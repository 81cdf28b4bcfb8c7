#include "pressure_advance/procedure/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_plan.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using ::testing::HasSubstr;

const Reach kReach{{0, 0, 0}, {250, 250, 250}};

bool Touch(const pressure_advance::BoundsMm& a, const pressure_advance::BoundsMm& b) {
  return a.min_x_mm < b.max_x_mm && b.min_x_mm < a.max_x_mm && a.min_y_mm < b.max_y_mm &&
         b.min_y_mm < a.max_y_mm;
}

TEST(Comparison, StandsBesideThePatternWhereverThatLies) {
  for (const double x_mm : {35.0, 106.0, 205.0}) {
    for (const double y_mm : {60.0, 103.0, 198.0}) {
      PatternConfig printed;
      printed.material = "pla";
      printed.position_x_mm = x_mm;
      printed.position_y_mm = y_mm;
      ASSERT_TRUE(Validate(printed)) << x_mm << " " << y_mm;
      const auto beside = ComparisonBeside(printed, 0.04, {}, kReach);
      ASSERT_TRUE(beside.has_value()) << x_mm << " " << y_mm << ": " << beside.error().message;
      ASSERT_TRUE(Validate(*beside));
      EXPECT_FALSE(Touch(LayOut(printed).printed, LayOut(*beside).printed)) << x_mm << " " << y_mm;
    }
  }
}

TEST(Comparison, HasTheSameLinesWithoutAndWithTheValue) {
  const auto config = ComparisonPattern({}, 0.0412);
  ASSERT_TRUE(config.has_value());
  const auto layout = LayOut(*config);
  ASSERT_EQ(layout.lines.size(), 2U * kComparisonLines);
  for (const auto& line : layout.lines) {
    EXPECT_EQ(line.pressure_advance_s, line.pattern == 0 ? 0 : 0.0412);
  }
}

TEST(Comparison, DoesNotHomeOverThePatternOnThePlate) {
  PatternConfig printed;
  printed.material = "pla";
  const auto beside = ComparisonBeside(printed, 0.04, {}, kReach);
  ASSERT_TRUE(beside.has_value());
  EXPECT_THAT(WriteGcode(LayOut(*beside), *beside), ::testing::Not(HasSubstr("G28")));
}

TEST(Comparison, RefusesABedWithoutRoomAndSaysWhatToDo) {
  const auto beside = ComparisonBeside({}, 0.04, {}, {{0, 0, 0}, {125, 125, 250}});
  ASSERT_FALSE(beside.has_value());
  EXPECT_EQ(beside.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(beside.error().message, HasSubstr("trammel pa validate"));
}

TEST(Comparison, RefusesAValueThatIsNone) {
  for (const double value_s : {0.0, -0.01, 0.00001, 11.0}) {
    EXPECT_FALSE(ComparisonPattern({}, value_s).has_value()) << value_s;
  }
}

}  // namespace
}  // namespace trammel::procedure

#include "pressure_advance/photo/other_patterns.h"

#include <gtest/gtest.h>

#include <vector>

#include "pressure_advance/photo/photo_test_support.h"

namespace trammel::pressure_advance {
namespace {

TEST(OtherPatterns, AWideGapBetweenLinesPartsTwoGroups) {
  const auto in_two = [](const std::vector<int>& steps) {
    vision::LinePattern lines;
    lines.steps = steps;
    lines.rungs.resize(steps.size() + 1);
    return InTwoGroups(lines);
  };
  EXPECT_TRUE(in_two({1, 1, 1, 1, 6, 1, 1, 1, 1}));
  EXPECT_FALSE(in_two({1, 1, 1, 1, 3, 1, 1, 1, 1}));  // two lines are missing
  EXPECT_FALSE(in_two({1, 1, 1, 6, 1, 1, 1, 1}));     // four lines are no pattern
  EXPECT_FALSE(in_two({1, 1, 1, 1, 1, 6}));
  EXPECT_FALSE(in_two({}));
}

TEST(OtherPatterns, LinesAreCountedWhereCornersAreExpected) {
  const auto count_of = [](std::size_t lines, PatternForm expected) {
    DrawnPhoto drawn = Usual();
    drawn.frame = false;
    drawn.pressure_advance_s = Steps(lines);
    PhotoSearch photo(Draw(drawn));
    return CountOfOtherKind(photo, expected);
  };
  EXPECT_EQ(count_of(7, PatternForm::kCorners), 7U);
  EXPECT_EQ(count_of(7, PatternForm::kLines), 0U);
  EXPECT_EQ(count_of(3, PatternForm::kCorners), 0U);
}

}  // namespace
}  // namespace trammel::pressure_advance

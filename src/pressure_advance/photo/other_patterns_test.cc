#include "pressure_advance/photo/other_patterns.h"

#include <gtest/gtest.h>

#include <vector>

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

}  // namespace
}  // namespace trammel::pressure_advance

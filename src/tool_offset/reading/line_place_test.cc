#include "tool_offset/reading/line_place.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace trammel::tool_offset {
namespace {

/// Cover of pixel i, [i - 0.5, i + 0.5], by a bar.
std::vector<float> Bar(double middle, double width, int count) {
  std::vector<float> ink;
  for (int i = 0; i < count; ++i) {
    const double low = std::max(i - 0.5, middle - width / 2);
    const double high = std::min(i + 0.5, middle + width / 2);
    ink.push_back(static_cast<float>(std::max(0.0, high - low)));
  }
  return ink;
}

TEST(HalfInkPlace, IsExactForABarOfAnyWidthAtAnyPlaceAmongThePixels) {
  constexpr double kFloat = 1e-5;
  for (double width = 2.3; width < 9; width += 0.37) {
    for (double middle = 9; middle < 11; middle += 0.13) {
      const auto place = HalfInkPlace(Bar(middle, width, 21), 3, 17);
      ASSERT_TRUE(place.has_value());
      EXPECT_NEAR(place->middle, middle, kFloat);
      EXPECT_NEAR(place->ink, width, kFloat);
    }
  }
}

TEST(HalfInkPlace, FindsNothingOnPaperOrBesideTheSamples) {
  const std::vector<float> paper(20, 0.0F);
  EXPECT_FALSE(HalfInkPlace(paper, 2, 18).has_value());
  const std::vector<float> bar = Bar(10, 4, 20);
  EXPECT_FALSE(HalfInkPlace(bar, -1, 18).has_value());
  EXPECT_FALSE(HalfInkPlace(bar, 2, 19.6).has_value());
  EXPECT_FALSE(HalfInkPlace(bar, 12, 8).has_value());
  EXPECT_FALSE(HalfInkPlace(bar, std::nan(""), 8).has_value());
  EXPECT_FALSE(HalfInkPlace({}, 0, 1).has_value());
}

}  // namespace
}  // namespace trammel::tool_offset

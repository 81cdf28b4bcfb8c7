#include "pressure_advance/pattern.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trammel::pressure_advance {
namespace {

TEST(Pattern, OfThePaperIsTheDefaultAndCanBePrinted) {
  const PatternConfig config;
  ASSERT_TRUE(Validate(config)) << Validate(config).error().message;
  const PatternLayout layout = LayOut(config);
  ASSERT_EQ(layout.lines.size(), 10u);
  EXPECT_EQ(layout.lines.front().pressure_advance_s, 0.0);
  EXPECT_EQ(layout.lines.back().pressure_advance_s, 0.06);
  for (const PatternLine& line : layout.lines) {
    EXPECT_DOUBLE_EQ(line.end.x_mm - line.start.x_mm, 30.0);
    EXPECT_EQ(line.start.z_mm, 0.25);
  }
}

TEST(Pattern, ExtrudesThePapersFilamentPerMillimetre) {
  // The paper's code drives 0.045899 mm of filament per mm; its bead's width of 0.495 mm is that
  // figure turned into a width and rounded to 1 um or so.
  constexpr double kRounding = 2e-4;
  EXPECT_NEAR(FilamentPerMm(PatternConfig{}), 0.045899, kRounding);
}

}  // namespace
}  // namespace trammel::pressure_advance

#include "document/interval_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace trammel::report {
namespace {

TEST(IntervalText, SaysTheIntervalInOneUnit) {
  const Quantity quantity{0.0172, 0.0008, {0.01541, 0.01899}};
  EXPECT_EQ(IntervalText(quantity.interval95, kSeconds), "95 %: 0.0154 to 0.0190 s");
  EXPECT_EQ(WithInterval(quantity, kSeconds), "0.0172 s (95 %: 0.0154 to 0.0190 s)");
}

TEST(IntervalText, HasTwoDigitsOfHalfAnIntervalAndNeverFewerDecimalsThanAsked) {
  EXPECT_EQ(ValueText(1.23456789, {1.2343, 1.2349}, kMillimetres), "1.23457 mm");
  EXPECT_EQ(ValueText(1.23456789, {1, 2}, kMillimetres), "1.2346 mm");
  EXPECT_EQ(ValueText(1.23456789, {1, 2}, {.unit = "mm", .min_decimals = 1}), "1.23 mm");
  EXPECT_EQ(ValueText(1.23456789, {1.234567, 1.234568}, kMillimetres), "1.234568 mm");
}

TEST(IntervalText, ScalesAndKeepsTheOrder) {
  const IntervalStyle percent{.unit = "%", .scale = -100, .min_decimals = 1, .signs = true};
  EXPECT_EQ(WithInterval(-0.25, {-0.4, -0.1}, percent), "+25.0 % (95 %: +10.0 to +40.0 %)");
}

TEST(IntervalText, NeverSaysMinusZero) {
  EXPECT_EQ(NumberText(-1e-9, 3, true), "+0.000");
  EXPECT_EQ(NumberText(-0.0012, 3, true), "-0.001");
  EXPECT_EQ(IntervalText({-1e-9, 1e-9}, {.unit = "mm", .min_decimals = 4}),
            "95 %: 0.000000 to 0.000000 mm");
  EXPECT_EQ(ValueText(-1e-9, {-0.5, 0.5}, kOffsetMillimetres), "+0.0000 mm");
}

TEST(IntervalText, TakesIntervalsThatAreNotFinite) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ValueText(1, {-inf, inf}, kSeconds), "1.0000 s");
  EXPECT_EQ(ValueText(1, {NAN, NAN}, kSeconds), "1.0000 s");
}

TEST(WithinText, ListsHalfWidthsInOneUnit) {
  const double halves_rad[] = {0.0000653, 0.001};
  EXPECT_EQ(WithinText(halves_rad, kPerMille), "95 %: within 0.0653, 1.0000 mm/m");
  EXPECT_EQ(WithinText({halves_rad, 1}, kPerMille), "95 %: within 0.0653 mm/m");
}

TEST(NormalInterval95, IsTwoPointsOfTheNormalDistributionApart) {
  const Interval interval = NormalInterval95(3, 2);
  EXPECT_NEAR(interval.lo, -0.92, 0.001);
  EXPECT_NEAR(interval.hi, 6.92, 0.001);
}

}  // namespace
}  // namespace trammel::report

#include "pressure_advance/response/tested_range.h"

#include <gtest/gtest.h>

#include <string>

namespace trammel::pressure_advance {
namespace {

constexpr Interval kTested{0.02, 0.08};

RangedAnswer Judge(double value_s, double half_s, const Interval& tested = kTested) {
  return JudgeInRange(value_s, half_s / 2, half_s, tested, 0.1, "too wide");
}

TEST(TestedRange, AnswersInsideUpToWhereTheIntervalFits) {
  EXPECT_TRUE(Judge(0.0779, 0.002).pressure_advance.good());
  EXPECT_TRUE(Judge(0.0221, 0.002).pressure_advance.good());
  EXPECT_FALSE(Judge(0.05, 0.002).print_next_s);
}

TEST(TestedRange, GivesNoNumberWhoseIntervalReachesPastAnEdge) {
  for (const double value_s : {0.0781, 0.0799, 0.0801, 0.083, 0.14}) {
    const RangedAnswer judged = Judge(value_s, 0.002);
    EXPECT_EQ(judged.pressure_advance.verdict(), Verdict::kCannotTell) << value_s;
    EXPECT_NE(judged.pressure_advance.reason().find("above the tested range"), std::string::npos);
    ASSERT_TRUE(judged.print_next_s) << value_s;
    EXPECT_LT(judged.print_next_s->lo, value_s);
    EXPECT_GT(judged.print_next_s->hi, value_s);
  }
  for (const double value_s : {0.0219, 0.0201, 0.0199, 0.01, -0.03}) {
    const RangedAnswer judged = Judge(value_s, 0.002);
    EXPECT_EQ(judged.pressure_advance.verdict(), Verdict::kCannotTell) << value_s;
    EXPECT_NE(judged.pressure_advance.reason().find("below the tested range"), std::string::npos);
    ASSERT_TRUE(judged.print_next_s) << value_s;
    EXPECT_GE(judged.print_next_s->lo, 0);
    EXPECT_GT(judged.print_next_s->hi, judged.print_next_s->lo);
  }
}

TEST(TestedRange, ZeroIsNoEdgeBecauseNothingLiesBelow) {
  const Interval from_zero{0, 0.06};
  const RangedAnswer near = Judge(0.001, 0.003, from_zero);
  ASSERT_TRUE(near.pressure_advance.good()) << near.pressure_advance.reason();
  EXPECT_EQ(near.pressure_advance.quantity().interval95.lo, 0);
  EXPECT_DOUBLE_EQ(near.pressure_advance.quantity().interval95.hi, 0.004);
  const RangedAnswer negative = Judge(-0.002, 0.003, from_zero);
  ASSERT_TRUE(negative.pressure_advance.good());
  const Quantity& q = negative.pressure_advance.quantity();
  EXPECT_EQ(q.value, 0);
  EXPECT_GE(q.interval95.hi - q.interval95.lo, 2 * q.standard_uncertainty);
  const RangedAnswer nonsense = Judge(-0.01, 0.003, from_zero);
  EXPECT_EQ(nonsense.pressure_advance.verdict(), Verdict::kCannotTell);
  EXPECT_NE(nonsense.pressure_advance.reason().find("below 0"), std::string::npos);
  EXPECT_FALSE(nonsense.print_next_s);
}

TEST(TestedRange, BlamesTheWidthOfAnIntervalOnlyInside) {
  EXPECT_EQ(Judge(0.05, 0.01).pressure_advance.reason(), "too wide");
  EXPECT_NE(Judge(0.1, 0.01).pressure_advance.reason(), "too wide");
}

TEST(TestedRange, AsksForMoreOfTheScaleTheFartherItExtrapolated) {
  const Interval near = PrintNext(0.08, kTested);
  EXPECT_NEAR(near.hi - near.lo, 0.06, 1e-12);
  const Interval far = PrintNext(0.11, kTested);
  EXPECT_NEAR(far.lo, 0.05, 1e-12);
  EXPECT_NEAR(far.hi, 0.17, 1e-12);
}

}  // namespace
}  // namespace trammel::pressure_advance

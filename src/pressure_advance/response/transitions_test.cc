#include "pressure_advance/response/transitions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

constexpr double kRounding = 1e-12;

LineMotion Motion(double length_mm = 30) {
  return {{{0.25, 5}, {0.5, 150}, {0.25, 5}}, length_mm, 3000};
}

TransitionPlan Plan(const LineMotion& motion, double longest_lag_s = 0.06) {
  return *PlanTransitions(motion, PositionUnit::kMillimetre, longest_lag_s);
}

TEST(Transitions, LieWhereTheSpeedChangesWithItsSignAndSize) {
  const TransitionPlan plan = Plan(Motion());
  EXPECT_NEAR(plan.acceleration.boundary, 7.5, kRounding);
  EXPECT_NEAR(plan.deceleration.boundary, 22.5, kRounding);
  EXPECT_EQ(plan.acceleration.speed_change_mm_s, 145);
  EXPECT_EQ(plan.deceleration.speed_change_mm_s, -145);
  for (const TransitionWindow& window : {plan.acceleration, plan.deceleration}) {
    EXPECT_LT(window.span.lo, window.boundary);
    EXPECT_GT(window.span.hi, window.boundary);
  }
  EXPECT_NEAR(plan.acceleration.fast_length, plan.acceleration.span.hi - 7.5, kRounding);
  EXPECT_NEAR(plan.deceleration.fast_length, 22.5 - plan.deceleration.span.lo, kRounding);
}

TEST(Transitions, NeverShareAStretchWithEachOtherOrTheReference) {
  for (const double length_mm : {22.0, 30.0, 60.0, 200.0}) {
    const TransitionPlan plan = Plan(Motion(length_mm));
    const Interval& acceleration = plan.acceleration.span;
    const Interval& deceleration = plan.deceleration.span;
    EXPECT_LE(acceleration.hi, deceleration.lo + kRounding) << length_mm;
    ASSERT_EQ(plan.reference.size(), 2u);
    for (const Interval& reference : plan.reference) {
      EXPECT_GE(reference.lo, 0);
      EXPECT_LE(reference.hi, length_mm);
      EXPECT_LT(reference.lo, reference.hi) << length_mm;
      EXPECT_TRUE(reference.hi <= acceleration.lo + kRounding ||
                  reference.lo >= acceleration.hi - kRounding)
          << length_mm;
      EXPECT_TRUE(reference.hi <= deceleration.lo + kRounding ||
                  reference.lo >= deceleration.hi - kRounding)
          << length_mm;
    }
  }
}

TEST(Transitions, TakeASteadyMiddleForReferenceOnlyWhereFourLagsPass) {
  // Speeding up takes (150^2 - 5^2) / 6000 = 3.75 mm, four lags of 60 ms at 150 mm/s 36 mm; the
  // middle begins at 0.35 of the fast half: from 39.75 / 0.175 = 227 mm of line on.
  EXPECT_FALSE(Plan(Motion(226)).steady_middle);
  EXPECT_TRUE(Plan(Motion(228)).steady_middle);
  EXPECT_TRUE(Plan(Motion(30), 0.0).steady_middle);  // without a lag the ramp alone: 21.4 mm
  LineMotion photo{Motion().segments, {}, {}};
  const auto plan = PlanTransitions(photo, PositionUnit::kLineLength, 0.1);
  ASSERT_TRUE(plan);
  EXPECT_TRUE(plan->steady_middle);
  EXPECT_NEAR(plan->acceleration.boundary, 0.25, kRounding);
}

TEST(Transitions, ScaleWithTheLine) {
  const TransitionPlan one = Plan(Motion(30), 0);
  const TransitionPlan two = Plan(Motion(60), 0);
  EXPECT_NEAR(two.acceleration.span.lo, 2 * one.acceleration.span.lo, kRounding);
  EXPECT_NEAR(two.deceleration.span.hi, 2 * one.deceleration.span.hi, kRounding);
}

TEST(Transitions, AreRefusedByNameWhereTheSegmentsHaveNone) {
  const std::vector<std::vector<Segment>> wrong = {
      {},
      {{1, 50}},
      {{0.5, 5}, {0.5, 150}},
      {{0.25, 150}, {0.5, 5}, {0.25, 150}},
      {{0.25, 5}, {0.5, 150}, {0.25, 150}},
      {{0.25, 5}, {0.25, 150}, {0.25, 5}, {0.25, 150}}};
  for (const auto& segments : wrong) {
    LineMotion motion = Motion();
    motion.segments = segments;
    const auto plan = PlanTransitions(motion, PositionUnit::kMillimetre, 0.06);
    ASSERT_FALSE(plan);
    EXPECT_THAT(plan.error().message, HasSubstr("a slow, a fast and a slow one"));
  }
}

// Ramps of 3.746 mm, of which one may take 0.35 of the fast half.
TEST(Transitions, AreRefusedWhereNoSteadyFlowPartsThem) {
  for (const double length_mm : {14.0, 21.0}) {
    const auto plan = PlanTransitions(Motion(length_mm), PositionUnit::kMillimetre, 0.06);
    ASSERT_FALSE(plan) << length_mm;
    EXPECT_THAT(plan.error().message, HasSubstr("is too short for a steady stretch"));
    EXPECT_THAT(plan.error().message, HasSubstr("or lines of at least 22 mm"));
  }
  EXPECT_TRUE(PlanTransitions(Motion(22), PositionUnit::kMillimetre, 0.06));
}

// There the flow still rises, or the surplus still drains, however short the line is.
TEST(Transitions, OfAShortLineNeitherItsStartNorTheTailBehindTheSecondChangeIsAReference) {
  const LineMotion motion{{{0.16, 10}, {0.6, 150}, {0.24, 10}}, 25, 3000};
  const TransitionPlan plan = Plan(motion);
  EXPECT_NEAR(plan.reference[0].lo, 2.5, kRounding);
  EXPECT_NEAR(plan.deceleration.span.hi, 19 + 3, kRounding);
  EXPECT_NEAR(plan.reference[1].lo, 22, kRounding);
  LineMotion shorter = motion;
  shorter.length_mm = 12.5;
  shorter.acceleration_mm_s2 = 6000;
  EXPECT_LE(Plan(shorter).reference[0].lo, Plan(shorter).reference[0].hi);
}

}  // namespace
}  // namespace trammel::pressure_advance

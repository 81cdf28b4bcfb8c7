#include "pressure_advance/response/transitions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "pressure_advance/response/lag_line_test_support.h"

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
  EXPECT_TRUE(Plan(Motion(30), 0.0).steady_middle);  // ramp alone, no lag: 21.4 mm
  LineMotion photo{Motion().segments, {}, {}};
  const auto plan = PlanTransitions(photo, PositionUnit::kLineLength, 0.1);
  ASSERT_TRUE(plan);
  EXPECT_TRUE(plan->steady_middle);
  EXPECT_NEAR(plan->acceleration.boundary, 0.25, kRounding);
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

// Lines of width 30 px that change with PA only in a bump around `at`, under noise and uneven
// light.
std::vector<LineProfile> Lines(double at, double half_width, double gain, double noise,
                               Random& random) {
  std::vector<LineProfile> profiles;
  for (int line = 0; line < 21; ++line) {
    LineProfile profile;
    profile.pressure_advance_s = 0.005 * line;
    profile.position_unit = PositionUnit::kLineLength;
    for (int i = 0; i < 300; ++i) {
      ProfileSample sample;
      sample.position = (i + 0.5) / 300;
      const double u = (sample.position - at) / half_width;
      const double bump = std::abs(u) < 1 ? 1 - u * u : 0;
      const double light = 1 + 0.05 * std::sin(3 * sample.position + line);
      sample.width = {
          30 * light * (1 + gain * profile.pressure_advance_s * bump) + noise * random.Normal(), 1};
      profile.samples.push_back(sample);
    }
    profiles.push_back(profile);
  }
  return profiles;
}

TEST(RespondingStretch, HoldsTheStretchThatAnswersWithItsSignAndLittleMore) {
  for (const bool rising : {true, false}) {
    Random random(1);
    const auto lines = Lines(0.3, 0.06, rising ? 4 : -4, 1, random);
    const auto stretch = RespondingStretch(lines, Reading::kWidth, {0.1, 0.6}, rising, 0.15);
    ASSERT_TRUE(stretch);
    EXPECT_LT(stretch->lo, 0.26);
    EXPECT_GT(stretch->lo, 0.19);
    EXPECT_GT(stretch->hi, 0.34);
    EXPECT_LT(stretch->hi, 0.41);
  }
}

// Printed lines just within and just beyond, where the last reference begins.
TEST(SettledLines, AreEvenToAPerCentThere) {
  trammel::testing::LagLine line;
  line.length_mm = 80;
  line.slow_mm_s = 10;
  line.fast_mm_s = 60;
  line.acceleration_mm_s2 = 5000;
  line.smooth_time_s = 0.01;
  const auto plan = PlanTransitions(MotionOf(line), PositionUnit::kLineLength, 1);
  ASSERT_TRUE(plan);
  const auto at =
      static_cast<std::size_t>(plan->reference.back().lo * line.length_mm / line.step_mm);
  std::vector<double> tested_s;
  for (int i = 0; i <= 1000; ++i) tested_s.push_back(0.001 * i);
  for (const double lag_s : {0.1, 0.16, 0.22}) {
    const Interval settled = SettledLines(lag_s, tested_s, *plan, line.length_mm, line.slow_mm_s);
    const auto uneven = [&](double pa_s) {
      return std::abs(trammel::testing::PrintLagLine(line, {.linear_s = lag_s}, pa_s)[at] - 1);
    };
    EXPECT_LT(uneven(settled.hi - 0.01), 0.012) << lag_s;
    EXPECT_GT(uneven(settled.hi + 0.02), 0.01) << lag_s;
    if (settled.lo > 0) {
      EXPECT_LT(uneven(settled.lo + 0.01), 0.012) << lag_s;
      EXPECT_GT(uneven(settled.lo - 0.01), 0.008) << lag_s;
    }
  }
  // Of a lag that nothing follows in time, the nearest four.
  const Interval none = SettledLines(0.9, {0, 0.25, 0.5, 0.75, 1}, *plan, 80, 10);
  EXPECT_LE(none.lo, 0.25);
  EXPECT_GT(none.lo, 0);
}

// Windows of 8 mm: more than 2 mm of either in one piece cannot be bridged.
TEST(UnseenStretch, NamesAGapOfMoreThanAQuarterOfATransition) {
  TransitionPlan plan;
  plan.acceleration.span = {8, 16};
  plan.deceleration.span = {16, 24};
  struct Row {
    double lo_mm, hi_mm, step_mm;
    const char* says;
  };
  for (const Row& row :
       {Row{0, 0, 0.25, ""}, Row{17, 18.7, 0.25, ""}, Row{1, 7, 0.25, ""}, Row{24.5, 29, 0.25, ""},
        Row{0, 0, 2.5, ""}, Row{17, 20, 0.25, "no frame shows the line from 16.9 to 20.1 mm"},
        Row{9, 12, 0.25, "no frame shows the line from 8.85 to 12.1 mm"},
        Row{21, 40, 0.25, "no frame shows the line from 20.9 to 24 mm"},
        Row{-1, 11, 0.25, "no frame shows the line from 8 to 11.1 mm"}}) {
    std::vector<std::optional<double>> frames = {std::nullopt};
    for (double at = 0.1; at < 30; at += row.step_mm) {
      if (at <= row.lo_mm || at >= row.hi_mm) frames.emplace_back(at);
    }
    EXPECT_EQ(NameUnseenStretch(frames, plan), row.says) << row.lo_mm;
  }
}

}  // namespace
}  // namespace trammel::pressure_advance

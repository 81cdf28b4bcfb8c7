#include "pressure_advance/response/combine_transitions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

// Ten lines that answer with slope 1 and cross zero at `zero_s`, with noise of 1 ms a line.
TransitionSeries Series(double zero_s, std::uint64_t seed, double slope = 1) {
  Random random(seed);
  TransitionSeries series;
  for (int i = 0; i < 10; ++i) {
    const double pa = 0.06 * i / 9;
    series.pa_s.push_back(pa);
    series.surplus_s.push_back(slope * (zero_s - pa) + 0.001 * random.Normal());
    series.sigma_s.push_back(0);
  }
  return series;
}

struct Both {
  ResponseOptions options;
  Transitions transitions;

  Both(double zero_a_s, double zero_d_s)
      : transitions{Series(zero_a_s, 11), Series(zero_d_s, 12), std::nullopt, 0, 0} {}
  [[nodiscard]] CombinedTransitions Combine() const {
    return CombineTransitions(transitions, *FitTransitions(transitions, options), true, options);
  }
};

double Uncertainty(const Measured& measured) { return measured.quantity().standard_uncertainty; }

TEST(CombineTransitions, SlipIsLearntFromTheDifferenceAndCancelsInTheMean) {
  // 2.5 % of slip over 80 ms moves each crossing by 2 ms, in opposite directions. Of that, the
  // crossings' scatter (0.5 ms each) leaves the prior less than a tenth.
  constexpr double kLeft_s = 0.0002;
  const double without_s = Both(0.03, 0.03).Combine().both.pressure_advance.quantity().value;
  Both world(0.032, 0.028);
  world.transitions.acceleration.slip_surplus_s = 0.08;
  world.transitions.deceleration.slip_surplus_s = 0.08;
  const CombinedTransitions combined = world.Combine();
  EXPECT_NEAR(combined.both.pressure_advance.quantity().value, without_s, 2 * kLeft_s);
  EXPECT_NEAR(combined.acceleration.quantity().value, combined.deceleration.quantity().value,
              2 * kLeft_s);
  EXPECT_NEAR(combined.acceleration_shift_s, -0.002, 0.0007);
  EXPECT_NEAR(combined.deceleration_shift_s, 0.002, 0.0007);
  EXPECT_TRUE(combined.notices.empty());
}

TEST(CombineTransitions, UnreadFilamentMovesBothAlikeAndDoesNotAverageOut) {
  Both world(0.03, 0.03);
  world.options.slip_sigma = world.options.lag_form_sigma = world.options.lag_tail_sigma = 0;
  world.transitions.acceleration = Series(0.03, 11, 0.5);
  world.transitions.deceleration = Series(0.03, 12, 0.5);
  const double unread_s = world.options.unread_sigma * (world.options.full_slope - 0.5) * 0.03;
  EXPECT_GT(Uncertainty(world.Combine().both.pressure_advance), 0.9 * unread_s);
}

TEST(CombineTransitions, WidensWhereTheTwoDisagree) {
  const double agreed = Uncertainty(Both(0.03, 0.03).Combine().both.pressure_advance);
  const CombinedTransitions apart = Both(0.0275, 0.0325).Combine();
  const Measured& both = apart.both.pressure_advance;
  ASSERT_TRUE(both.good()) << both.reason();
  EXPECT_GT(Uncertainty(both), 1.5 * agreed);
  EXPECT_EQ(apart.notices.size(), 1u);
}

TEST(CombineTransitions, ATransitionThatDoesNotAnswerLeavesTheOther) {
  Both world(0.03, 0.03);
  world.transitions.deceleration = Series(0.03, 12, 0);
  const CombinedTransitions combined = world.Combine();
  EXPECT_EQ(combined.deceleration.verdict(), Verdict::kCannotTell);
  const Measured& both = combined.both.pressure_advance;
  ASSERT_TRUE(both.good()) << both.reason();
  EXPECT_EQ(both.quantity().value, combined.acceleration.quantity().value);
}

// The photo cuts off the slow-down of all lines on one side of the answer, and towards high
// pressure advance a gap cannot get emptier: the straight line's crossing is far off.
TEST(CombineTransitions, ACrossingBeyondTheLinesThatShowItCountsForNothing) {
  Both world(0.015, 0.015);
  TransitionSeries& d = world.transitions.deceleration;
  for (std::size_t i = 0; i < d.pa_s.size(); ++i) {
    d.surplus_s[i] = std::max(d.surplus_s[i], -0.013 - 0.6 * (d.pa_s[i] - 0.028));
    if (d.pa_s[i] < 0.028) d.sigma_s[i] = std::numeric_limits<double>::infinity();
  }
  const CombinedTransitions combined = world.Combine();
  EXPECT_EQ(combined.deceleration.verdict(), Verdict::kCannotTell);
  EXPECT_NE(combined.deceleration.reason().find("all above the answer"), std::string::npos)
      << combined.deceleration.reason();
  const Measured& both = combined.both.pressure_advance;
  ASSERT_TRUE(both.good()) << both.reason();
  EXPECT_EQ(both.quantity().value, combined.acceleration.quantity().value);
}

TEST(CombineTransitions, LinesOnOneSideAreNamedWhereTheyDoNotAnswerClearly) {
  Both world(0.2, 0.2);
  for (TransitionSeries* series :
       {&world.transitions.acceleration, &world.transitions.deceleration}) {
    for (std::size_t i = 0; i < series->surplus_s.size(); ++i) {
      series->surplus_s[i] = 0.05 + (i % 2 == 0 ? 0.01 : -0.01);  // full up: the slope is gone
    }
  }
  const RangedAnswer both = world.Combine().both;
  EXPECT_NE(both.pressure_advance.reason().find("above the tested range"), std::string::npos)
      << both.pressure_advance.reason();
  ASSERT_TRUE(both.print_next_s);
  EXPECT_GT(both.print_next_s->hi, 0.12);
}

TEST(CombineTransitions, ThePicturesPartIsOfTheTestedRangeAndMovesNoValue) {
  const CombinedTransitions sharp = Both(0.03, 0.03).Combine();
  Both blurred(0.03, 0.03);
  blurred.options.picture_sigma = 0.02;
  const CombinedTransitions combined = blurred.Combine();
  EXPECT_EQ(combined.both.pressure_advance.quantity().value,
            sharp.both.pressure_advance.quantity().value);
  constexpr double kPicture_s = 0.02 * 0.06, kRounding_s = 1e-12;
  for (const auto& [with, without] :
       {std::pair{combined.both.pressure_advance, sharp.both.pressure_advance},
        std::pair{combined.acceleration, sharp.acceleration}}) {
    EXPECT_NEAR(Uncertainty(with), std::hypot(Uncertainty(without), kPicture_s), kRounding_s);
  }
}

}  // namespace
}  // namespace trammel::pressure_advance

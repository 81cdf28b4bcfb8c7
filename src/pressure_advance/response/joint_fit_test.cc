#include "pressure_advance/response/joint_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "base/random.h"
#include "base/statistics.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {
namespace {

struct Made {
  double zero_s = 0.032;
  double slip = 0;
  double tail_s = 0;
  double lag_scatter_s = 0;
  double level_scatter = 0;
  double reading_s = 0;
  double gaps_flatten = 0;  // the deceleration's slope falls by this part behind the answer
};

constexpr double kSlipA_s = 0.054, kSlipD_s = 0.023, kSlipEarly_s = 0.03;
constexpr double kLevelA_s = 0.072, kLevelD_s = 0.057, kLevelEarly_s = 0.047;

// Ten lines of slope 0.9 from 0 to 0.06 s.
Transitions Make(const Made& made, std::uint64_t seed = 7) {
  Random random(seed);
  const JointFitOptions options;
  Transitions transitions;
  transitions.early.emplace();
  TransitionSeries& a = transitions.acceleration;
  TransitionSeries& d = transitions.deceleration;
  TransitionSeries& early = *transitions.early;
  a.slip_excess_s = kSlipA_s;
  d.slip_excess_s = kSlipD_s;
  early.slip_excess_s = kSlipEarly_s;
  a.level_excess_s = kLevelA_s;
  d.level_excess_s = kLevelD_s;
  early.level_excess_s = kLevelEarly_s;
  for (int i = 0; i < 10; ++i) {
    const double pa_s = 0.06 * i / 9;
    const double u = made.zero_s + made.lag_scatter_s * random.Normal() - pa_s;
    const double level = made.level_scatter * random.Normal();
    const auto add = [&](TransitionSeries& series, double excess_s) {
      series.pa_s.push_back(pa_s);
      series.excess_s.push_back(excess_s + made.reading_s * random.Normal());
      series.sigma_s.push_back(made.reading_s);
    };
    constexpr double kSlope = 0.9;
    add(a,
        kSlope * (u + options.tail_share * made.tail_s) + kSlipA_s * made.slip + kLevelA_s * level);
    add(d, kSlope * (u > 0 ? u : (1 - made.gaps_flatten) * u) +
               kSlope * options.tail_share * made.tail_s - kSlipD_s * made.slip -
               kLevelD_s * level);
    add(early, 0.8 * (u + (1 + options.tail_share) * made.tail_s) + kSlipEarly_s * made.slip +
                   kLevelEarly_s * level);
  }
  return transitions;
}

std::optional<JointFit> Fit(const Transitions& transitions) {
  const auto crossings = FitTransitions(transitions, ResponseOptions{});
  return FitJointly(transitions, *crossings, JointFitOptions{});
}

TEST(JointFit, FindsAnswerSlipAndTailWithoutNoise) {
  // What priors of 2 % of slip, 5 % of tail and a bent deceleration pull.
  constexpr double kPulled_s = 0.0003;
  const auto fit = Fit(Make({.slip = 0.02, .tail_s = 0.001}));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->both.value_s, 0.032, kPulled_s);
  EXPECT_NEAR(fit->acceleration.value_s, 0.032, kPulled_s);
  EXPECT_NEAR(fit->deceleration.value_s, 0.032, kPulled_s);
  EXPECT_NEAR(fit->slip_share, 0.02, 0.004);
  EXPECT_NEAR(fit->tail_s, 0.001, 0.0003);
}

TEST(JointFit, LinesWithLagsOfTheirOwnMoveItNoFurtherThanTheirMean) {
  constexpr double kScatter_s = 0.0015;
  constexpr int kPrints = 200;
  std::vector<double> error, slip, pull;
  for (int i = 0; i < kPrints; ++i) {
    const auto fit = Fit(Make({.lag_scatter_s = kScatter_s, .reading_s = 0.0002}, 100 + i));
    ASSERT_TRUE(fit);
    error.push_back(fit->both.value_s - 0.032);
    slip.push_back(fit->slip_share);
    pull.push_back(error.back() / std::sqrt(fit->both.lines + fit->both.slip + fit->both.form));
  }
  // No method is better than the mean of the lags; bends that are not known cost the rest.
  const double bound_s = kScatter_s / std::sqrt(10.0);
  EXPECT_LT(StandardDeviation(error), 1.5 * bound_s);
  // Crossings fitted apart would take the lags for 2 % of slip.
  EXPECT_LT(StandardDeviation(slip), 0.005);
  EXPECT_GT(StandardDeviation(pull), 0.7);
  EXPECT_LT(StandardDeviation(pull), 1.3);
}

TEST(JointFit, ErrorsOfTheLevelWidenEachTransitionMoreThanBoth) {
  const auto fit = Fit(Make({.level_scatter = 0.02, .reading_s = 0.0002}));
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->both.lines + fit->both.slip, fit->acceleration.lines + fit->acceleration.slip);
}

TEST(JointFit, BelievesMuchSlipWhereTheLinesShowIt) {
  const auto fit = Fit(Make({.slip = 0.1, .lag_scatter_s = 0.001, .reading_s = 0.0002}));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->slip_share, 0.1, 0.015);
  EXPECT_NEAR(fit->both.value_s, 0.032, 0.0015);
}

TEST(JointFit, GapsThatFlattenTheDecelerationDoNotMoveIt) {
  constexpr double kTolerance_s = 0.0008;  // a third of what a straight line would be off by
  const auto fit = Fit(Make({.lag_scatter_s = 0.0005, .reading_s = 0.0002, .gaps_flatten = 0.5}));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->both.value_s, 0.032, kTolerance_s);
}

TEST(JointFit, AnOddLineCountsNothing) {
  const Made made{.lag_scatter_s = 0.001, .reading_s = 0.0002};
  const auto without = Fit(Make(made));
  Transitions odd = Make(made);
  odd.deceleration.excess_s[5] += 0.05;
  const auto with = Fit(odd);
  ASSERT_TRUE(without && with);
  EXPECT_NEAR(with->both.value_s, without->both.value_s, 0.0005);
}

TEST(JointFit, IsAbsentWithoutAnEarlyWindowALevelOrFourLinesThatShowBoth) {
  Transitions transitions = Make({});
  transitions.acceleration.level_excess_s = 0;
  EXPECT_FALSE(Fit(transitions));
  transitions = Make({});
  transitions.early.reset();
  EXPECT_FALSE(Fit(transitions));
  transitions = Make({});
  for (int i = 0; i < 4; ++i) {
    transitions.deceleration.sigma_s[i] = std::numeric_limits<double>::infinity();
    transitions.acceleration.sigma_s[9 - i] = std::numeric_limits<double>::infinity();
  }
  EXPECT_FALSE(Fit(transitions));
}

}  // namespace
}  // namespace trammel::pressure_advance

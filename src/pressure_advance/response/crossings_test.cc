#include "pressure_advance/response/crossings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

TransitionSeries Line(double zero_s, double slope) {
  TransitionSeries series;
  for (int i = 0; i < 10; ++i) {
    series.pa_s.push_back(0.06 * i / 9);
    series.surplus_s.push_back(slope * (zero_s - series.pa_s.back()));
    series.sigma_s.push_back(0.0001);
  }
  return series;
}

// Given lines that leave the picture at one speed change, the other counts, as if only that had
// been requested.
TEST(FitTransitions, LinesCountWhereTheyShowATransition) {
  Transitions all{Line(0.03, 1), Line(0.02, 0.8), std::nullopt, 0, 0};
  Transitions fewer = all;
  for (const std::size_t i : {0U, 1U, 2U}) {
    fewer.acceleration.sigma_s[i] = std::numeric_limits<double>::infinity();
    fewer.acceleration.surplus_s[i] = 1e3;
  }
  const auto crossings = FitTransitions(fewer, {});
  ASSERT_TRUE(crossings);
  EXPECT_NEAR(crossings->acceleration.zero, 0.03, 0.001);
  EXPECT_EQ(crossings->deceleration.zero, FitTransitions(all, {})->deceleration.zero);
  ASSERT_EQ(crossings->acceleration.influence.size(), 10U);
  for (const std::size_t i : {0U, 1U, 2U}) {
    EXPECT_EQ(crossings->acceleration.influence[i], 0);
    EXPECT_EQ(crossings->acceleration.weight[i], 0);
  }
  EXPECT_NE(crossings->acceleration.weight[5], 0);
}

constexpr double kTail_s = 0.002;

TransitionSeries Series(double zero_s, double noise_s, std::uint64_t seed) {
  Random random(seed);
  TransitionSeries series;
  for (int i = 0; i < 20; ++i) {
    series.pa_s.push_back(0.06 * i / 19);
    series.surplus_s.push_back(zero_s - series.pa_s.back() + noise_s * random.Normal());
    series.sigma_s.push_back(0);
  }
  return series;
}

CrossingPair Correct(const Transitions& transitions) {
  const ResponseOptions options;
  return CorrectCrossings(transitions, *FitTransitions(transitions, options), true, options);
}

// An early window whose crossing lies a tail further up, read with noise of its own.
Transitions WithTail(double early_noise_s) {
  return {Series(0.03, 1e-4, 1), Series(0.03, 1e-4, 2), Series(0.03 + kTail_s, early_noise_s, 3), 0,
          0};
}

TEST(CrossingPair, AClearTailIsTakenOutOfBoth) {
  const CrossingPair pair = Correct(WithTail(1e-4));
  const double moved_s = ResponseOptions{}.tail_share * kTail_s;
  constexpr double kNoise_s = 0.0002;  // three crossings of twenty lines with 0.1 ms each
  EXPECT_NEAR(pair.acceleration.zero_s, 0.03 - moved_s, kNoise_s);
  EXPECT_NEAR(pair.deceleration.zero_s, 0.03 - moved_s, kNoise_s);
}

TEST(CrossingPair, ANoisyTailMovesAndWidensLittle) {
  const Transitions noisy = WithTail(0.02);
  Transitions none = noisy;
  none.early.reset();
  const CrossingPair seen = Correct(noisy);
  const CrossingPair unseen = Correct(none);
  const ResponseOptions options;
  const double prior_s = options.tail_share * options.tail_sigma * 0.03;
  EXPECT_LT(std::abs(seen.acceleration.zero_s - unseen.acceleration.zero_s), prior_s);
  EXPECT_LT(std::hypot(std::sqrt(seen.acceleration.variance), seen.acceleration.common.form),
            std::hypot(std::sqrt(unseen.acceleration.variance), 1.2 * prior_s));
}

TEST(CrossingPair, ScatterAboutTheLaidLinesIsThatOfTheCrossings) {
  constexpr double kNoise_s = 5e-4;
  constexpr int kPatterns = 400;
  const Transitions laid{Series(0.03, 0, 1), Series(0.03, 0, 2), Series(0.03, 0, 3)};
  std::vector<double> acceleration, deceleration, told_a, told_d, told_both;
  for (std::uint64_t seed = 1; seed <= kPatterns; ++seed) {
    // The early window sees nearly what the whole one sees.
    Transitions seen{Series(0.03, kNoise_s, 3 * seed), Series(0.03, kNoise_s, 3 * seed + 1),
                     Series(0.03, kNoise_s / 3, 3 * seed + 2)};
    for (std::size_t i = 0; i < seen.early->surplus_s.size(); ++i) {
      seen.early->surplus_s[i] += seen.acceleration.surplus_s[i] - laid.acceleration.surplus_s[i];
    }
    const TransitionCrossings crossings = *FitTransitions(seen, {});
    const CrossingPair pair = CorrectCrossings(seen, crossings, true, {});
    const PairVariances about = ScatterAbout(laid, seen, crossings, pair);
    acceleration.push_back(pair.acceleration.zero_s);
    deceleration.push_back(pair.deceleration.zero_s);
    told_a.push_back(about.acceleration);
    told_d.push_back(about.deceleration);
    told_both.push_back(about.covariance);
  }
  // A standard deviation of 400 values is known to 3.5 %; robust fits lose some per cent of lines.
  constexpr double kShare = 0.12;
  const double sigma_a = StandardDeviation(acceleration);
  const double sigma_d = StandardDeviation(deceleration);
  EXPECT_NEAR(std::sqrt(Mean(told_a)), sigma_a, kShare * sigma_a);
  EXPECT_NEAR(std::sqrt(Mean(told_d)), sigma_d, kShare * sigma_d);
  double together = 0;
  for (std::size_t i = 0; i < acceleration.size(); ++i) {
    together += (acceleration[i] - Mean(acceleration)) * (deceleration[i] - Mean(deceleration));
  }
  EXPECT_NEAR(Mean(told_both), together / kPatterns, 0.1 * sigma_a * sigma_d);
}

// Both crossings without slip are weighed from the two: noise that only one has moves both.
TEST(CrossingPair, LessSlipEachHasAShareOfTheOthersScatter) {
  CrossingPair pair;
  pair.acceleration = {0, 1e-6, {.slip = 1e-3}};
  pair.deceleration = {0, 4e-6, {.slip = 2e-3}};
  pair.covariance = 0.5e-6;
  const PairVariances told =
      LessSlip({pair.acceleration.variance, pair.deceleration.variance, pair.covariance},
               EstimateSlip(pair));
  Random random(11);
  constexpr int kPatterns = 20000;
  std::vector<double> a_s, d_s;
  for (int i = 0; i < kPatterns; ++i) {
    // Standard deviations of 1 and 2 ms with a correlation of a quarter.
    const double own = random.Normal();
    pair.acceleration.zero_s = 1e-3 * own;
    pair.deceleration.zero_s = 2e-3 * (0.25 * own + std::sqrt(1 - 0.25 * 0.25) * random.Normal());
    const double slip = EstimateSlip(pair).mean;
    a_s.push_back(pair.acceleration.zero_s - slip * pair.acceleration.common.slip);
    d_s.push_back(pair.deceleration.zero_s + slip * pair.deceleration.common.slip);
  }
  constexpr double kShare = 0.03;  // a variance of 20,000 values is known to 1 %
  EXPECT_NEAR(told.acceleration / std::pow(StandardDeviation(a_s), 2), 1, kShare);
  EXPECT_NEAR(told.deceleration / std::pow(StandardDeviation(d_s), 2), 1, kShare);
  EXPECT_LT(told.deceleration, 0.7 * pair.deceleration.variance);
}

constexpr double kAnswer_s = 0.036;
constexpr double kSlip_s = 0.003;  // difference at the answer
constexpr double kOwnLag_s = 0.005;
constexpr double kFlow_s = 0.0002;

struct Lines {
  TransitionSeries acceleration, deceleration;
};

// Ten lines of which each has a lag of its own. Of the filament beyond the answer `lost` does not
// show; `early_s` before the answer already.
Lines TenLines(std::uint64_t seed, double slip_s, double lost = 0, double early_s = 0) {
  Random random(seed);
  Lines lines;
  for (int i = 0; i < 10; ++i) {
    const double pa_s = 0.06 * i / 9;
    const double own_s = kAnswer_s - pa_s + kOwnLag_s * random.Normal();
    const double shown = 0.55 + 0.45 * std::pow(pa_s / kAnswer_s, 2);
    const double past_s = std::max(0.0, pa_s - kAnswer_s + early_s);
    for (TransitionSeries* series : {&lines.acceleration, &lines.deceleration}) {
      const bool rises = series == &lines.acceleration;
      series->pa_s.push_back(pa_s);
      series->surplus_s.push_back(own_s + (rises ? 0.7 : -0.3) * slip_s * shown +
                                  (rises ? 0 : lost * past_s) + kFlow_s * random.Normal());
      series->sigma_s.push_back(0);
    }
  }
  return lines;
}

PairedDifference Fit(const Lines& lines, double slip_s) {
  return FitPairedDifference(lines.acceleration, lines.deceleration, kAnswer_s + 0.7 * slip_s, 1,
                             0.7, {});
}

// 0.3 ms a line over six lines, and what the form of the slip leaves open: a tenth of the lags.
constexpr double kNear_s = 0.0005;

TEST(PairedDifference, ALinesOwnLagCancelsAndGapsAndABlobMoveItLittle) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const PairedDifference difference = Fit(TenLines(seed, kSlip_s), kSlip_s);
    EXPECT_NEAR(difference.value_s, kSlip_s, kNear_s) << seed;
    EXPECT_LT(std::abs(difference.value_s - kSlip_s), 2.5 * std::sqrt(difference.variance()));
    EXPECT_LT(std::sqrt(difference.variance()), kNear_s);
    EXPECT_FALSE(difference.cut_off);
  }
  EXPECT_NEAR(Fit(TenLines(1, kSlip_s, 0.6), kSlip_s).value_s, kSlip_s, kNear_s);
  Lines lines = TenLines(1, kSlip_s);
  lines.deceleration.surplus_s[3] += 0.02;
  EXPECT_NEAR(Fit(lines, kSlip_s).value_s, kSlip_s, kNear_s);
}

TEST(PairedDifference, BelowZeroItIsFilamentThatGapsLost) {
  const PairedDifference difference = Fit(TenLines(1, 0, 0.8, 0.015), 0);
  EXPECT_TRUE(difference.cut_off);
  EXPECT_GE(difference.value_s, -std::sqrt(difference.variance()) * 1.001);
  for (const double influence : difference.influence) EXPECT_EQ(influence, 0);
}

constexpr LagDriftOptions kOptions;

TEST(LagDrift, GainIsWhatAFirstOrderLagHasLaidDown) {
  // Steps dm/dt = 1 - m / lag along the ramp, then dm/dt = -m / lag; the gain is the integral of m
  // over the ramp's.
  for (const double lag_s : {0.005, 0.03, 0.06}) {
    constexpr double kRamp_s = 0.048, kDrain_s = 0.04, kStep_s = 1e-6;
    double missing = 0, laid = 0;
    for (double t = 0; t < kRamp_s + kDrain_s; t += kStep_s) {
      missing += kStep_s * ((t < kRamp_s ? 1 : 0) - missing / lag_s);
      laid += kStep_s * missing;
    }
    EXPECT_NEAR(GainOfALinearLag(lag_s, kRamp_s, kDrain_s), laid / (kRamp_s * lag_s), 1e-3);
  }
}

TEST(LagDrift, ASteeperOrFlatterSlopeShowsItsSign) {
  EXPECT_NEAR(EstimateLagDrift(0.86 * 0.9, 0.005, 0.86, 0, kOptions).mean, 0.1, 0.005);
  EXPECT_NEAR(EstimateLagDrift(0.86 * 1.1, 0.005, 0.86, 0, kOptions).mean, -0.1, 0.005);
}

}  // namespace
}  // namespace trammel::pressure_advance

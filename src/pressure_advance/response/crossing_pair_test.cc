#include "pressure_advance/response/crossing_pair.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kTail_s = 0.002;

TransitionSeries Series(double zero_s, double noise_s, std::uint64_t seed) {
  Random random(seed);
  TransitionSeries series;
  for (int i = 0; i < 20; ++i) {
    series.pa_s.push_back(0.06 * i / 19);
    series.excess_s.push_back(zero_s - series.pa_s.back() + noise_s * random.Normal());
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

TEST(CrossingPair, NoEarlyWindowLeavesTheCrossings) {
  Transitions none = WithTail(1e-4);
  none.early.reset();
  const CrossingPair pair = Correct(none);
  EXPECT_EQ(pair.tail_s, 0);
  EXPECT_NEAR(pair.acceleration.zero_s, 0.03, 0.0001);
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
    for (std::size_t i = 0; i < seen.early->excess_s.size(); ++i) {
      seen.early->excess_s[i] += seen.acceleration.excess_s[i] - laid.acceleration.excess_s[i];
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

}  // namespace
}  // namespace trammel::pressure_advance

#include "pressure_advance/response/crossing_pair.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "base/random.h"

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

}  // namespace
}  // namespace trammel::pressure_advance

#include "pressure_advance/response/fit_transitions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

// Ten lines of which each has a lag of its own, seen alike at both transitions; gaps lose three
// quarters of the deceleration's answer.
struct Lines {
  TransitionSeries acceleration;
  TransitionSeries deceleration;
};

Lines Draw(double zero_s, double lag_scatter_s, Random& random) {
  constexpr double kReading_s = 0.0003;
  Lines lines;
  for (int i = 0; i < 10; ++i) {
    const double pa = 0.06 * i / 9;
    const double surplus_s = zero_s + lag_scatter_s * random.Normal() - pa;
    for (TransitionSeries* series : {&lines.acceleration, &lines.deceleration}) {
      series->pa_s.push_back(pa);
      series->sigma_s.push_back(0);
    }
    lines.acceleration.excess_s.push_back(surplus_s + kReading_s * random.Normal());
    lines.deceleration.excess_s.push_back((surplus_s > 0 ? surplus_s : 0.25 * surplus_s) +
                                          kReading_s * random.Normal());
  }
  return lines;
}

TEST(FitTransitions, LearnsTheBendFromTheLinesWhereTheirLagsScatter) {
  constexpr int kPatterns = 100;
  constexpr double kLagScatter_s = 0.002;
  std::vector<double> apart_s, alone_s;
  for (int seed = 0; seed < kPatterns; ++seed) {
    Random random(600 + seed);
    const Lines lines = Draw(random.Uniform(0.02, 0.04), kLagScatter_s, random);
    const ResponseOptions options;
    const auto joint = FitTransitions(lines.acceleration, lines.deceleration, options);
    ASSERT_TRUE(joint);
    const auto alone = signal::FitZeroCrossing(lines.deceleration.pa_s, lines.deceleration.excess_s,
                                               lines.deceleration.sigma_s, options.deceleration);
    apart_s.push_back(joint->deceleration.zero - joint->acceleration.zero);
    alone_s.push_back(alone->zero - joint->acceleration.zero);
  }
  EXPECT_LT(StandardDeviation(apart_s), 0.6 * StandardDeviation(alone_s));
  // 5 standard errors of the mean.
  EXPECT_NEAR(Mean(apart_s), 0, 5 * StandardDeviation(apart_s) / std::sqrt(kPatterns));
}

TEST(FitTransitions, NeedsThreeDifferentPressureAdvances) {
  Random random(1);
  Lines lines = Draw(0.03, 0, random);
  for (TransitionSeries* series : {&lines.acceleration, &lines.deceleration}) {
    for (double& pa : series->pa_s) pa = pa > 0.03 ? 0.06 : 0;
  }
  EXPECT_FALSE(FitTransitions(lines.acceleration, lines.deceleration, {}));
}

}  // namespace
}  // namespace trammel::pressure_advance

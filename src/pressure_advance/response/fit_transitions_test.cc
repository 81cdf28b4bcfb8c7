#include "pressure_advance/response/fit_transitions.h"

#include <gtest/gtest.h>

#include <limits>

namespace trammel::pressure_advance {
namespace {

TransitionSeries Line(double zero_s, double slope) {
  TransitionSeries series;
  for (int i = 0; i < 10; ++i) {
    series.pa_s.push_back(0.06 * i / 9);
    series.excess_s.push_back(slope * (zero_s - series.pa_s.back()));
    series.sigma_s.push_back(0.0001);
  }
  return series;
}

TEST(FitTransitions, FitsEachByItself) {
  const auto crossings =
      FitTransitions({Line(0.03, 1), Line(0.02, 0.8), Line(0.031, 0.9), 0, 0}, {});
  ASSERT_TRUE(crossings);
  EXPECT_NEAR(crossings->acceleration.zero, 0.03, 0.001);
  EXPECT_NEAR(crossings->deceleration.zero, 0.02, 0.001);
  EXPECT_NEAR(crossings->tail_s(), 0.001, 0.0001);
}

// Of the lines that leave the picture beside a speed change the other one counts, as if they had
// not been asked for more.
TEST(FitTransitions, LinesCountWhereTheyShowATransition) {
  Transitions all{Line(0.03, 1), Line(0.02, 0.8), std::nullopt, 0, 0};
  Transitions fewer = all;
  for (const std::size_t i : {0U, 1U, 2U}) {
    fewer.acceleration.sigma_s[i] = std::numeric_limits<double>::infinity();
    fewer.acceleration.excess_s[i] = 1e3;
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

TEST(FitTransitions, NeedsThreeDifferentPressureAdvances) {
  TransitionSeries two = Line(0.03, 1);
  for (double& pa_s : two.pa_s) pa_s = pa_s > 0.03 ? 0.06 : 0;
  EXPECT_FALSE(FitTransitions({two, two, std::nullopt, 0, 0}, {}));
}

}  // namespace
}  // namespace trammel::pressure_advance

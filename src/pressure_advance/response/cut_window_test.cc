#include "pressure_advance/response/cut_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

TEST(CutWindow, IsWhatLinesWithALikePartShow) {
  const std::vector<double> parts{-4, -3, -2, -1, 0, 1, 2};
  std::vector<double> wholes;
  for (const double part : parts) wholes.push_back(0.5 + 1.5 * part);
  const auto completed = CompleteWindow(parts, wholes, 0.4);
  ASSERT_TRUE(completed.has_value());
  constexpr double kRounding = 1e-9;
  EXPECT_NEAR(completed->value, 0.5 + 1.5 * 0.4, kRounding);
  EXPECT_NEAR(completed->per_part, 1.5, kRounding);
  EXPECT_NEAR(completed->sigma, 0, kRounding);
}

TEST(CutWindow, NeedsFiveLinesThatDiffer) {
  const std::vector<double> four{0, 1, 2, 3}, alike(6, 1.0);
  EXPECT_FALSE(CompleteWindow(four, four, 1).has_value());
  EXPECT_FALSE(CompleteWindow(alike, alike, 1).has_value());
}

// Gaps get no emptier than empty: beyond some part the whole grows no further.
TEST(CutWindow, FollowsLinesNearItWhereTheOthersSaturate) {
  std::vector<double> parts, wholes;
  for (int i = 0; i <= 20; ++i) {
    parts.push_back(-0.1 * i);
    wholes.push_back(std::max(-1.2, 1.5 * parts.back()));
  }
  const auto completed = CompleteWindow(parts, wholes, -0.05);
  ASSERT_TRUE(completed.has_value());
  EXPECT_NEAR(completed->value, -0.075, 0.1);  // a straight line through all is 0.3 off
}

TEST(CutWindow, SigmaHoldsTheLinesScatter) {
  constexpr int kRepeats = 2000, kLines = 15;
  constexpr double kScatter = 0.1;
  Random random(1);
  std::vector<double> pulls;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    std::vector<double> parts, wholes;
    for (int i = 0; i < kLines; ++i) {
      parts.push_back(-0.1 * i);
      wholes.push_back(1.5 * parts.back() + kScatter * random.Normal());
    }
    const double part = random.Uniform(-0.7, 0.1);
    const double truth = 1.5 * part + kScatter * random.Normal();
    const auto completed = CompleteWindow(parts, wholes, part);
    ASSERT_TRUE(completed.has_value());
    pulls.push_back((completed->value - truth) / completed->sigma);
  }
  EXPECT_NEAR(Mean(pulls), 0, 4 / std::sqrt(static_cast<double>(kRepeats))) << "seed 1";
  // Few weighted lines tell their own scatter badly: Student's t, not the normal distribution.
  EXPECT_GT(RobustStandardDeviation(pulls), 0.9) << "seed 1";
  EXPECT_LT(RobustStandardDeviation(pulls), 1.2) << "seed 1";
}

}  // namespace
}  // namespace trammel::pressure_advance

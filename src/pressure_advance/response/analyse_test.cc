#include "pressure_advance/response/analyse.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

struct Scores {
  std::vector<double> pa;
  DeviationResult deviation;
};

// A parabola with its minimum at `at`, fitted as itself.
Scores Parabola(double at, double noise, Random& random) {
  Scores scores;
  for (int i = 0; i < 10; ++i) {
    const double p = 0.06 * i / 9;
    scores.pa.push_back(p);
    scores.deviation.score_px.push_back(20 + 5e4 * (p - at) * (p - at) + noise * random.Normal());
  }
  scores.deviation.cubic = {20 + 5e4 * at * at, -1e5 * at, 5e4, 0};
  scores.deviation.cubic_minimum_s = at;
  scores.deviation.r_squared = 0.95;
  return scores;
}

TEST(JudgeDeviation, IsNeverSurerThanItsGrid) {
  Random random(1);
  const Scores scores = Parabola(0.03, 0, random);
  const Measured judged = JudgeDeviation(scores.deviation, scores.pa);
  ASSERT_TRUE(judged.good());
  EXPECT_NEAR(judged.quantity().standard_uncertainty, 0.06 / 9 / std::sqrt(12.0), 1e-9);
}

TEST(JudgeDeviation, GrowsWithTheScatterOfTheScores) {
  Random random(2);
  const Scores quiet = Parabola(0.03, 0.1, random);
  const Scores loud = Parabola(0.03, 10, random);
  EXPECT_GT(JudgeDeviation(loud.deviation, loud.pa).quantity().standard_uncertainty,
            1.5 * JudgeDeviation(quiet.deviation, quiet.pa).quantity().standard_uncertainty);
}

TEST(JudgeDeviation, SaysWhyItCannotTell) {
  Random random(3);
  Scores scores = Parabola(0.03, 1, random);
  scores.deviation.r_squared = 0.2;
  EXPECT_EQ(JudgeDeviation(scores.deviation, scores.pa).verdict(), Verdict::kCannotTell);
  scores = Parabola(0.03, 1, random);
  scores.deviation.cubic_minimum_s.reset();
  EXPECT_EQ(JudgeDeviation(scores.deviation, scores.pa).verdict(), Verdict::kCannotTell);
  scores.deviation.score_px.assign(10, std::nullopt);
  EXPECT_EQ(JudgeDeviation(scores.deviation, scores.pa).verdict(), Verdict::kRefused);
}

TEST(Analyse, RefusesTheDeviationWhereNoHeightsWereSeen) {
  const Analysis analysis = Analyse({}, {}, {}, Method::kDeviation);
  EXPECT_EQ(analysis.pressure_advance.verdict(), Verdict::kRefused);
  EXPECT_NE(analysis.pressure_advance.reason().find("photo"), std::string::npos);
}

}  // namespace
}  // namespace trammel::pressure_advance

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

Verdict VerdictOf(const Scores& scores) {
  return JudgeDeviation(scores.deviation, scores.pa).pressure_advance.verdict();
}

TEST(JudgeDeviation, IsNeverSurerThanItsGrid) {
  Random random(1);
  const Scores scores = Parabola(0.03, 0, random);
  const Measured judged = JudgeDeviation(scores.deviation, scores.pa).pressure_advance;
  ASSERT_TRUE(judged.good());
  EXPECT_NEAR(judged.quantity().standard_uncertainty, 0.06 / 9 / std::sqrt(12.0), 1e-9);
}

TEST(JudgeDeviation, GrowsWithTheScatterOfTheScores) {
  Random random(2);
  const Scores quiet = Parabola(0.03, 0.1, random);
  const Scores loud = Parabola(0.03, 10, random);
  const auto uncertainty = [](const Scores& scores) {
    return JudgeDeviation(scores.deviation, scores.pa)
        .pressure_advance.quantity()
        .standard_uncertainty;
  };
  EXPECT_GT(uncertainty(loud), 1.5 * uncertainty(quiet));
}

TEST(JudgeDeviation, SaysWhyItCannotTell) {
  Random random(3);
  Scores scores = Parabola(0.03, 1, random);
  scores.deviation.r_squared = 0.2;
  EXPECT_EQ(VerdictOf(scores), Verdict::kCannotTell);
  scores = Parabola(0.03, 1, random);
  scores.deviation.cubic_minimum_s.reset();
  EXPECT_EQ(VerdictOf(scores), Verdict::kCannotTell);
  scores.deviation.score_px.assign(10, std::nullopt);
  EXPECT_EQ(VerdictOf(scores), Verdict::kRefused);
}

TEST(JudgeDeviation, GivesNoNumberWhereItsIntervalReachesPastTheTestedRange) {
  Random random(4);
  Scores scores = Parabola(0.058, 0, random);
  const RangedAnswer judged = JudgeDeviation(scores.deviation, scores.pa);
  EXPECT_EQ(judged.pressure_advance.verdict(), Verdict::kCannotTell);
  ASSERT_TRUE(judged.print_next_s);
  EXPECT_NEAR(judged.print_next_s->lo, 0.028, 1e-9);
  EXPECT_NEAR(judged.print_next_s->hi, 0.088, 1e-9);
}

TEST(JudgeDeviation, SaysToWhichEndTheScoresFall) {
  Random random(5);
  Scores high = Parabola(0.09, 0, random);
  high.deviation.cubic_minimum_s.reset();
  const RangedAnswer above = JudgeDeviation(high.deviation, high.pa);
  EXPECT_NE(above.pressure_advance.reason().find("falls towards higher"), std::string::npos);
  ASSERT_TRUE(above.print_next_s);
  EXPECT_GT(above.print_next_s->hi, 0.0899);
  Scores none = Parabola(-0.03, 0, random);
  none.deviation.cubic_minimum_s.reset();
  const RangedAnswer at_zero = JudgeDeviation(none.deviation, none.pa);
  EXPECT_NE(at_zero.pressure_advance.reason().find("lowest at 0"), std::string::npos);
  EXPECT_FALSE(at_zero.print_next_s);
}

TEST(Analyse, RefusesTheDeviationWhereNoHeightsWereSeen) {
  const Analysis analysis = Analyse({}, {}, {}, Method::kDeviation);
  EXPECT_EQ(analysis.pressure_advance.verdict(), Verdict::kRefused);
  EXPECT_NE(analysis.pressure_advance.reason().find("photo"), std::string::npos);
}

}  // namespace
}  // namespace trammel::pressure_advance

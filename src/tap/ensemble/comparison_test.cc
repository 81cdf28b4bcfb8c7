#include "tap/ensemble/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace trammel::tap {
namespace {

using ::testing::HasSubstr;

constexpr double kMmPerUm = 1e-3;

TapResult Tap(double z_um, double x_mm = 10) {
  const double z_mm = kMmPerUm * z_um;
  return {.z_mm = Measured::Good({z_mm, 0.001, {z_mm - 0.002, z_mm + 0.002}}),
          .x_mm = x_mm,
          .y_mm = 20};
}

/// Two methods on the same taps: heights of the machine's own deviation, 1 um, with each method's
/// error. @param tail  The share of errors that are thrice as large.
std::vector<TapSeries> Draw(int taps, double first_um, double second_um, Random& random,
                            double tail = 0) {
  std::vector<TapSeries> series = {{"two-line", {}}, {"contact", {}}};
  const auto error = [&] {
    const double size = random.Uniform(0, 1) < tail ? 3 : 1;
    return size * random.Normal() / std::sqrt(1 + 8 * tail);
  };
  for (int i = 0; i < taps; ++i) {
    const double truth_um = random.Normal();
    series[0].taps.push_back(Tap(truth_um + first_um * error()));
    series[1].taps.push_back(Tap(truth_um + second_um * error()));
  }
  return series;
}

bool Holds(const Measured& measured, double truth) {
  const Interval& interval = measured.quantity().interval95;
  return interval.lo <= truth && truth <= interval.hi;
}

TEST(Comparison, GivesTheDeviationsOfHandWorkedTaps) {
  std::vector<TapSeries> series(2);
  for (int i = 0; i < 10; ++i) {
    series[0].taps.push_back(Tap(i % 2 == 0 ? 4 : 0));
    series[1].taps.push_back(Tap(i % 2 == 0 ? 1 : 0));
  }
  const auto found = Compare(series, true);
  // Ten heights that alternate by 2 a about their mean: a sqrt(10 / 9).
  EXPECT_NEAR(found[0].deviation_mm.quantity().value, 0.002 * std::sqrt(10.0 / 9), 1e-12);
  EXPECT_DOUBLE_EQ(found[0].mean_step_mm, 0.004);
  EXPECT_NEAR(found[1].ratio.quantity().value, 0.25, 1e-12);
  EXPECT_DOUBLE_EQ(found[0].claimed_mm, 0.001);
}

TEST(Comparison, IntervalsCoverTheTruth) {
  constexpr int kDraws = 1000;
  constexpr double kMinCover = 0.95 - 3 * 0.0069;  // three deviations of a share of 1000 draws
  constexpr double kMinHeavyCover = 0.89;          // Miller 1968: the jackknife at 20 taps
  Random random(1001);
  struct Case {
    int taps;
    double first_um;
    double tail;
    bool same_taps;
  };
  for (const Case& c :
       {Case{9, 3, 0, true}, {100, 3, 0, true}, {20, 0.5, 0, false}, {20, 3, 0.1, true}}) {
    const double first_um = std::hypot(1, c.first_um);
    const double second_um = std::hypot(1, 0.5);
    double ratio = 0;
    double deviation = 0;
    for (int i = 0; i < kDraws; ++i) {
      std::vector<TapSeries> series = Draw(c.taps, c.first_um, 0.5, random, c.tail);
      if (!c.same_taps) series[1] = Draw(c.taps, c.first_um, 0.5, random, c.tail)[1];
      const auto found = Compare(series, c.same_taps);
      ratio += Holds(found[1].ratio, second_um / first_um) ? 1.0 / kDraws : 0;
      deviation += Holds(found[1].deviation_mm, kMmPerUm * second_um) ? 1.0 / kDraws : 0;
    }
    EXPECT_GE(ratio, c.tail > 0 ? kMinHeavyCover : kMinCover) << c.taps;
    EXPECT_GE(deviation, c.tail > 0 ? kMinHeavyCover : kMinCover) << c.taps;
  }
}

TEST(Comparison, CountsAMeshAboutEachPlace) {
  Random random(1003);
  std::vector<TapSeries> mesh(1);
  for (int i = 0; i < 50; ++i) {
    mesh[0].taps.push_back(Tap(300 * std::sin(i % 25) + 3 * random.Normal(), 10.0 * (i % 25)));
  }
  EXPECT_TRUE(Holds(Compare(mesh, true)[0].deviation_mm, 0.003));
}

TEST(Comparison, UsesOnlyTapsThatAllSeriesHaveAndEnoughOfThem) {
  Random random(1005);
  std::vector<TapSeries> series = Draw(9, 3, 1, random);
  series[0].taps.push_back(Tap(9000));
  series[1].taps.push_back({});
  const auto found = Compare(series, true);
  EXPECT_EQ(found[0].good, 10U);
  EXPECT_EQ(found[0].used, 9U);
  EXPECT_TRUE(found[1].ratio.good());
  series[1].taps.front().z_mm = {};
  const Measured few = Compare(series, true)[1].ratio;
  EXPECT_EQ(few.verdict(), Verdict::kCannotTell);
  EXPECT_THAT(few.reason(), HasSubstr("7 degrees of freedom"));
  const std::vector<TapSeries> again = {{"", std::vector<TapResult>(12, Tap(1))}};
  EXPECT_THAT(Compare(again, true)[0].deviation_mm.reason(), HasSubstr("give each tap once"));
}

}  // namespace
}  // namespace trammel::tap

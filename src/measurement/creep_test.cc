#include "measurement/creep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "base/random.h"
#include "measurement/change.h"

namespace trammel::measurement {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kU_s = 0.0006;

Outcome Found(double value_s, double u_s = kU_s) {
  Outcome outcome;
  outcome.answers = {
      {"pressure_advance", "s",
       Measured::Good({value_s, u_s, {value_s - 1.96 * u_s, value_s + 1.96 * u_s}})}};
  outcome.subject = {"printer.local", "0.40", "PLA"};
  return outcome;
}

std::vector<Outcome> Of(const std::vector<double>& values_s) {
  std::vector<Outcome> series;
  for (const double value_s : values_s) series.push_back(Found(value_s));
  return series;
}

TEST(Creep, IsTheFittedLineFromTheFirstResultToTheLast) {
  std::vector<double> values_s;
  for (int i = 0; i < 11; ++i) values_s.push_back(0.04 + 0.001 * i + (i % 2 == 0 ? 1e-4 : -1e-4));
  const auto creep = FindCreep(Of(values_s));
  ASSERT_THAT(creep, SizeIs(1));
  EXPECT_EQ(creep[0].results, 11u);
  EXPECT_TRUE(creep[0].creeps);
  EXPECT_NEAR(creep[0].change.value, 0.010, 1e-12);
  // The slope's is u / sqrt(n (n^2 - 1) / 12); the scatter is smaller than the stated one.
  EXPECT_NEAR(creep[0].change.standard_uncertainty, 10 * kU_s / std::sqrt(110), 1e-12);
  EXPECT_NEAR(creep[0].change.interval95.hi - creep[0].change.value,
              1.959964 * 10 * kU_s / std::sqrt(110), 1e-9);
}

TEST(Creep, AsksForFiveGoodResultsAndAGoodLastOne) {
  EXPECT_THAT(FindCreep({}), IsEmpty());
  EXPECT_THAT(FindCreep(Of({1, 2, 3, 4})), IsEmpty());
  EXPECT_THAT(FindCreep(Of({1, 2, 3, 4, 5})), SizeIs(1));
  auto series = Of({1, 2, 3, 4, 5});
  series.back().answers[0].value = Measured::CannotTell("too little light");
  EXPECT_THAT(FindCreep(series), IsEmpty());
  series.push_back(Found(6));
  EXPECT_EQ(FindCreep(series)[0].results, 5u);
  series.back().answers[0].unit = "ms";
  EXPECT_THAT(FindCreep(series), IsEmpty());
}

TEST(Creep, OfEqualValuesIsNone) {
  EXPECT_FALSE(FindCreep(Of({0.04, 0.04, 0.04, 0.04, 0.04}))[0].creeps);
  // Nor of less than the stated uncertainties allow, however straight.
  EXPECT_FALSE(FindCreep(Of({0.0400, 0.0401, 0.0402, 0.0403, 0.0404}))[0].creeps);
}

// Each step is 0.3 standard uncertainties: within the noise of the result before.
TEST(Creep, IsSeenWhereTheMeanOfEarlierResultsShowsNothing) {
  constexpr int kSeries = 200;
  constexpr int kResults = 20;
  Random random(90210);
  int seen = 0;
  int by_mean = 0;
  for (int i = 0; i < kSeries; ++i) {
    std::vector<Outcome> series;
    for (int k = 0; k < kResults; ++k) {
      series.push_back(Found(0.04 + kU_s * (0.3 * k + random.Normal())));
    }
    seen += FindCreep(series)[0].creeps ? 1 : 0;
    const Outcome last = series.back();
    series.pop_back();
    by_mean += Drift(series, last)[0].differs() ? 1 : 0;
  }
  std::printf("seen at result %d: %d of %d; by the mean: %d\n", kResults, seen, kSeries, by_mean);
  EXPECT_GE(seen, 0.99 * kSeries);
  EXPECT_LE(by_mean, 0.6 * kSeries);
}

/// Of series without drift: the share of results that are called creeping, and of series in which
/// any is.
struct Called {
  double results = 0;
  double series = 0;
};

Called Try(const std::function<double(Random&)>& noise, std::uint64_t seed) {
  constexpr int kSeries = 1000;
  constexpr std::size_t kResults = 50;
  Random random(seed);
  int looks = 0;
  int called = 0;
  int ever = 0;
  for (int i = 0; i < kSeries; ++i) {
    std::vector<Outcome> series;
    bool any = false;
    for (std::size_t k = 0; k < kResults; ++k) {
      series.push_back(Found(0.04 + kU_s * noise(random)));
      if (series.size() < kFewestForCreep) continue;
      const bool creeps = FindCreep(series)[0].creeps;
      ++looks;
      called += creeps ? 1 : 0;
      any = any || creeps;
    }
    ever += any ? 1 : 0;
  }
  return {static_cast<double>(called) / looks, static_cast<double>(ever) / kSeries};
}

TEST(Creep, IsCalledFalselyInFiveOfAHundredSeriesOfFiftyResultsAtMost) {
  // Alarms come in runs: of one series 50 looks are worth about 5. Three standard deviations of
  // 5000 draws about kCreepFalseAlarm, and of 1000 series about 0.05.
  constexpr double kMostResults = kCreepFalseAlarm + 3 * 0.00063;
  constexpr double kMostSeries = 0.05;
  std::uint64_t seed = 7700;
  const auto check = [&](const char* name, const std::function<double(Random&)>& noise) {
    const Called called = Try(noise, ++seed);
    std::printf("%-28s %.4f of the results, %.3f of the series\n", name, called.results,
                called.series);
    EXPECT_LE(called.results, kMostResults) << name;
    EXPECT_LE(called.series, kMostSeries) << name;
  };
  check("as stated", [](Random& random) { return random.Normal(); });
  check("ten times what is stated", [](Random& random) { return 10 * random.Normal(); });
  check("a tenth of what is stated", [](Random& random) { return 0.1 * random.Normal(); });
  check("one in ten is an outlier", [](Random& random) {
    const double value = random.Normal();
    return random.Uniform(0, 1) < 0.1 ? 5 * value : value;
  });
}

}  // namespace
}  // namespace trammel::measurement

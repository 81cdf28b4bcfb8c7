#include "tap/ensemble/ensemble.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace trammel::tap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Measured Height(double z_mm, double sigma_mm) {
  return Measured::Good({z_mm, sigma_mm, {z_mm - 2 * sigma_mm, z_mm + 2 * sigma_mm}});
}

void Raise(TapResult& tap, double by_mm) {
  const Quantity height = tap.z_mm.quantity();
  tap.z_mm = Height(height.value + by_mm, height.standard_uncertainty);
}

std::vector<TapResult> Taps(std::size_t count, double sigma_mm, Random& random) {
  std::vector<TapResult> taps;
  for (std::size_t i = 0; i < count; ++i) {
    taps.push_back(
        {Height(0.1 + sigma_mm * random.Normal(), sigma_mm), 10.0 * static_cast<double>(i)});
  }
  return taps;
}

TEST(Ensemble, GivesRangeDeviationAndMeanStepOfHandWorkedTaps) {
  const std::vector<TapResult> taps = {
      {Height(0.001, 0.002), 0}, {Height(0.003, 0.002), 1}, {{}, 2}, {Height(0.002, 0.002), 3}};
  const Ensemble found = Summarise(taps);
  EXPECT_EQ(found.taps, 4u);
  EXPECT_EQ(found.good, 3u);
  EXPECT_NEAR(found.range_mm, 0.002, 1e-12);
  EXPECT_NEAR(found.standard_deviation_mm, 0.001, 1e-12);
  EXPECT_NEAR(found.mean_step_mm, 0.0015, 1e-12);
  EXPECT_NEAR(found.predicted_deviation_mm, 0.002, 1e-12);
  ASSERT_THAT(found.places, SizeIs(1));
  EXPECT_EQ(found.places[0].taps, 3u);
}

TEST(Ensemble, FewTapsHaveNoScatterAndNoTrend) {
  EXPECT_TRUE(std::isnan(Summarise({}).standard_deviation_mm));
  const std::vector<TapResult> one = {{Height(0.1, 0.001), 0}};
  EXPECT_TRUE(std::isnan(Summarise(one).range_mm));
  EXPECT_FALSE(Summarise(one).with_time);
  const std::vector<TapResult> refused(5);
  EXPECT_EQ(Summarise(refused).good, 0u);
}

TEST(Ensemble, TakesOutATapThatStandsApartAndNoOther) {
  Random random(4);
  auto taps = Taps(30, 0.001, random);
  Raise(taps[11], 0.02);
  const Ensemble found = Summarise(taps);
  EXPECT_THAT(found.outliers, ElementsAre(11u));
  EXPECT_LT(found.standard_deviation_mm, 0.0015);
}

TEST(Ensemble, ADriftMakesNoOutliersAndIsFoundWithItsUncertainty) {
  constexpr double kSlope = 5e-5;  // mm/s: 15 um over the 30 taps, where they scatter by 1 um
  int within = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(100 + run));
    auto taps = Taps(30, 0.001, random);
    for (TapResult& tap : taps) Raise(tap, kSlope * tap.time_s);
    const Ensemble found = Summarise(taps);
    ASSERT_TRUE(found.with_time);
    EXPECT_TRUE(found.with_time->significant);
    EXPECT_LE(found.outliers.size(), 1u);
    within += found.with_time->slope.interval95.lo <= kSlope &&
              kSlope <= found.with_time->slope.interval95.hi;
  }
  // 95 % of 200 runs, with three standard deviations of a binomial count (3.1) to either side.
  EXPECT_NEAR(within, 190, 10);
}

TEST(Ensemble, ScatterAloneIsCalledADriftInOneCaseOfTwenty) {
  int called = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(500 + run));
    const Ensemble found = Summarise(Taps(12, 0.001, random));
    called += found.with_time && found.with_time->significant;
  }
  EXPECT_NEAR(called, 20, 14);  // three standard deviations (4.4) of the count
}

TEST(Ensemble, GrowthOfTheNozzleShowsAgainstTemperature) {
  Random random(7);
  auto taps = Taps(20, 0.001, random);
  for (std::size_t i = 0; i < taps.size(); ++i) {
    taps[i].temperature_c = 150 + 5.0 * static_cast<double>(i % 7);
    Raise(taps[i], -3e-4 * taps[i].temperature_c);
  }
  const Ensemble found = Summarise(taps);
  ASSERT_TRUE(found.with_temperature);
  EXPECT_TRUE(found.with_temperature->significant);
  EXPECT_NEAR(found.with_temperature->slope.value, -3e-4,
              4 * found.with_temperature->slope.standard_uncertainty);
}

TEST(Ensemble, TheShapeOfAMeshIsNoScatter) {
  Random random(9);
  std::vector<TapResult> taps;
  for (int again = 0; again < 3; ++again) {
    for (int i = 0; i < 25; ++i) {
      const double x = 10.0 * (i % 5);
      const double y = 10.0 * (i / 5);
      taps.push_back({Height(0.002 * x + 0.001 * random.Normal(), 0.001),
                      static_cast<double>(taps.size()), std::nan(""), x + 0.01 * again, y});
    }
  }
  const Ensemble found = Summarise(taps);
  ASSERT_THAT(found.places, SizeIs(25));
  EXPECT_EQ(found.places[0].taps, 3u);
  EXPECT_NEAR(found.standard_deviation_mm, 0.001, 0.0003);  // 50 degrees of freedom: 10 %, 3 sigma
  EXPECT_LT(found.range_mm, 0.006);
}

TEST(Ensemble, AHundredThousandPlacesAreNoBurden) {
  std::vector<TapResult> taps;
  for (int i = 0; i < 100'000; ++i) {
    taps.push_back({Height(0, 0.001), static_cast<double>(i), 0, static_cast<double>(i), 0});
  }
  EXPECT_THAT(Summarise(taps).places, SizeIs(100'000));
  for (TapResult& tap : taps) tap.x_mm = 0;
  EXPECT_THAT(Summarise(taps).outliers, IsEmpty());
}

}  // namespace
}  // namespace trammel::tap

#include "signal/zero_crossing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::signal {
namespace {

std::vector<double> Range(double lo, double hi, int count) {
  std::vector<double> x(count);
  for (int i = 0; i < count; ++i) x[i] = lo + (hi - lo) * i / (count - 1);
  return x;
}

double Response(double x, double zero, double slope, double bend) {
  return -slope * ((x - zero) + bend * std::abs(x - zero));
}

TEST(ZeroCrossing, IsExactOnNoiseFreeData) {
  const std::vector<double> x = Range(0, 0.06, 10);
  for (const double zero : {0.0131, 0.03, 0.0457}) {
    std::vector<double> y;
    for (const double p : x) y.push_back(Response(p, zero, 0.85, 0));
    const auto fit = FitZeroCrossing(x, y, std::vector<double>(10, 0.0), {});
    ASSERT_TRUE(fit);
    constexpr double kRounding = 1e-8;
    EXPECT_NEAR(fit->zero, zero, kRounding);
    EXPECT_NEAR(fit->slope, 0.85, 1e-5);
  }
}

TEST(ZeroCrossing, ASaturatedSideDoesNotMoveTheCrossing) {
  const std::vector<double> x = Range(0, 0.06, 10);
  std::vector<double> y;
  for (const double p : x) y.push_back(Response(p, 0.0321, 0.7, -0.4));
  const auto fit =
      FitZeroCrossing(x, y, std::vector<double>(10, 0.0), {.bend_sigma = 0.3, .distance_sigma = 0});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->zero, 0.0321, 2e-6);
  EXPECT_NEAR(fit->bend, -0.4, 1e-3);
}

TEST(ZeroCrossing, OneWildPointChangesNothing) {
  const std::vector<double> x = Range(0, 0.06, 10);
  for (int bad = 0; bad < 10; ++bad) {
    Random random(17);
    std::vector<double> y;
    for (const double p : x) y.push_back(Response(p, 0.027, 0.85, 0) + 0.0002 * random.Normal());
    y[bad] += 0.05;
    const auto fit = FitZeroCrossing(x, y, std::vector<double>(10, 0.0), {});
    ASSERT_TRUE(fit);
    constexpr double kFiveSigma = 5 * 0.0002 / 0.85;
    EXPECT_NEAR(fit->zero, 0.027, kFiveSigma) << "bad point " << bad;
    EXPECT_LT(fit->weight[bad], 0.01);
  }
}

TEST(ZeroCrossing, IsUnbiasedAndNearlyAsGoodAsAStraightLineUnderNoise) {
  const std::vector<double> x = Range(0, 0.06, 10);
  constexpr double kNoise = 0.002;
  std::vector<double> error;
  Random random(23);
  for (int trial = 0; trial < 400; ++trial) {
    const double zero = random.Uniform(0.015, 0.045);
    std::vector<double> y;
    for (const double p : x) y.push_back(Response(p, zero, 1, 0) + kNoise * random.Normal());
    const auto fit = FitZeroCrossing(x, y, std::vector<double>(10, 0.0), {});
    ASSERT_TRUE(fit);
    error.push_back(fit->zero - zero);
  }
  // A straight line's crossing has about kNoise / sqrt(10) * 1.12 here. The bend and the robust
  // weights of so few points may cost 30 % more.
  EXPECT_LT(StandardDeviation(error), 1.3 * 1.12 * kNoise / std::sqrt(10.0));
  EXPECT_NEAR(Mean(error), 0, 4 * kNoise / std::sqrt(10.0 * 400));
}

TEST(ZeroCrossing, StatesItsScatter) {
  constexpr int kRuns = 400;
  constexpr double kNoise = 0.001;
  const std::vector<double> x = Range(0, 0.06, 12);
  const std::vector<double> sigma(x.size(), 0.0);
  Random random(5);
  std::vector<double> zeros, variances;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<double> y;
    for (const double p : x) y.push_back(Response(p, 0.027, 0.85, 0) + kNoise * random.Normal());
    const auto fit = FitZeroCrossing(x, y, sigma, {});
    ASSERT_TRUE(fit);
    zeros.push_back(fit->zero);
    variances.push_back(fit->zero_sigma * fit->zero_sigma);
  }
  // The bend, whose prior is given, is 0 in all runs: it adds nothing to their scatter.
  const double ratio = StandardDeviation(zeros) / std::sqrt(Mean(variances));
  EXPECT_GT(ratio, 0.8);
  EXPECT_LT(ratio, 1.15);
}

TEST(ZeroCrossing, MovesWithEachPointAsItsInfluenceSays) {
  constexpr double kStep = 2e-5;
  const std::vector<double> x = Range(0, 0.06, 12);
  const std::vector<double> sigma(x.size(), 0.0);
  Random random(6);
  std::vector<double> y;
  for (const double p : x) y.push_back(Response(p, 0.03, 0.85, 0.05) + 0.001 * random.Normal());
  const auto fit = FitZeroCrossing(x, y, sigma, {});
  ASSERT_TRUE(fit);
  double together = 0;
  for (const double influence : fit->influence) together += influence;
  std::vector<double> up(y), down(y);
  for (double& value : up) value += kStep;
  for (double& value : down) value -= kStep;
  const double moved =
      FitZeroCrossing(x, up, sigma, {})->zero - FitZeroCrossing(x, down, sigma, {})->zero;
  EXPECT_NEAR(together, moved / (2 * kStep), 0.1 * together);
}

TEST(ZeroCrossing, AWiderPriorOfTheBendLeavesMoreOpen) {
  const std::vector<double> x = Range(0, 0.06, 12);
  const std::vector<double> sigma(x.size(), 0.0);
  Random random(7);
  std::vector<double> y;
  for (const double p : x) y.push_back(Response(p, 0.03, 0.85, 0) + 0.001 * random.Normal());
  const auto narrow = FitZeroCrossing(x, y, sigma, {.bend_sigma = 0.001});
  const auto wide = FitZeroCrossing(x, y, sigma, {.bend_sigma = 0.2});
  EXPECT_LT(narrow->bend_shift, 0.05 * narrow->zero_sigma);
  EXPECT_GT(std::hypot(wide->zero_sigma, wide->bend_shift),
            std::hypot(narrow->zero_sigma, narrow->bend_shift));
}

TEST(ZeroCrossing, NeedsThreeDifferentAbscissae) {
  const std::vector<double> x = {0.01, 0.01, 0.02, 0.02};
  const std::vector<double> y = {1, 1, -1, -1};
  EXPECT_FALSE(FitZeroCrossing(x, y, std::vector<double>(4, 0.0), {}));
}

}  // namespace
}  // namespace trammel::signal

#include "tap/samples/line_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::tap {
namespace {

constexpr double kPeriod_s = 1.0 / 320;

struct Curve {
  std::vector<float> time_s;
  std::vector<float> force_g;
  [[nodiscard]] Samples View() const { return {time_s, force_g}; }
};

// Two lines that meet at sample `bend`, with normal noise.
Curve Bent(std::size_t count, double bend, double left_slope, double right_slope, double noise_g,
           Random& random) {
  Curve curve;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = (static_cast<double>(i) - bend) * kPeriod_s;
    curve.time_s.push_back(static_cast<float>(static_cast<double>(i) * kPeriod_s));
    curve.force_g.push_back(
        static_cast<float>((at < 0 ? left_slope : right_slope) * at + random.Normal(0, noise_g)));
  }
  return curve;
}

// The definition, straight from its words: every split, both lines fitted anew.
std::size_t SlowElbow(const Samples& samples, std::size_t first, std::size_t end,
                      std::size_t least) {
  double best = 1e300;
  std::size_t elbow = end;
  for (std::size_t i = first + least; i + least <= end; ++i) {
    const double sum =
        FitLine(samples, first, i).residual_g2 + FitLine(samples, i, end).residual_g2;
    if (sum < best) {
      best = sum;
      elbow = i;
    }
  }
  return elbow;
}

TEST(Elbow, EqualsTryingEverySplitByItsDefinition) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const auto count = static_cast<std::size_t>(4 + random.Below(60));
    const Curve curve =
        Bent(count, random.Uniform(0, static_cast<double>(count)), random.Uniform(-2000, 2000),
             random.Uniform(-2000, 2000), random.Uniform(0, 10), random);
    EXPECT_EQ(FindElbow(curve.View(), 0, count, 2), SlowElbow(curve.View(), 0, count, 2))
        << "trial " << trial;
  }
}

TEST(Elbow, TooFewOrEqualSamplesGiveNoElbowOrAnyButNeverFail) {
  const Curve flat{{0, 0, 0, 0, 0}, {7, 7, 7, 7, 7}};
  EXPECT_EQ(FindElbow(flat.View(), 0, 3, 2), 3U);
  EXPECT_EQ(FindElbow(flat.View(), 2, 2, 2), 2U);
  EXPECT_LE(FindElbow(flat.View(), 0, 5, 2), 3U);
  EXPECT_EQ(FitLine(flat.View(), 0, 5).slope_g_s, 0);
  EXPECT_EQ(FitLine(flat.View(), 3, 3).count, 0U);
}

TEST(Elbow, CrossingScattersAsItsUncertaintySaysWhereTheElbowIsKnown) {
  Random random(4);
  constexpr int kTrials = 2000;
  std::vector<double> errors;
  double predicted = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Curve curve = Bent(150, 44.6, -1120, 0, 2, random);
    const Crossing at = Intersect(FitLine(curve.View(), 0, 45), FitLine(curve.View(), 45, 150));
    errors.push_back(at.time_s - 44.6 * kPeriod_s);
    predicted += at.standard_uncertainty_s / kTrials;
  }
  // A standard deviation of n values is known to 1 / sqrt(2 n) = 1.6 %; three times that.
  EXPECT_NEAR(StandardDeviation(errors) / predicted, 1, 3 * 1.6e-2);
  EXPECT_NEAR(Mean(errors) / predicted, 0, 3 / std::sqrt(kTrials));
}

}  // namespace
}  // namespace trammel::tap

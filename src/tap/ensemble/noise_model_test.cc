#include "tap/ensemble/noise_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/statistics.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kStretches = 20;
constexpr std::size_t kSamples = 200;
constexpr double kRate_hz = 320;

/// Stretches on slopes of their own; x_i = correlation x_(i-1) + e_i of deviation 1, and a sine.
std::vector<FreeStretch> Draw(double correlation, double sine_g, double sine_hz, Random& random) {
  std::vector<FreeStretch> stretches;
  for (std::size_t s = 0; s < kStretches; ++s) {
    FreeStretch stretch;
    stretch.approach = s % 2 == 0;
    const double slope = random.Normal(0, 0.1);
    const double phase = random.Uniform(0, 6.28);
    double x = random.Normal();
    for (std::size_t i = 0; i < kSamples; ++i) {
      const double t = static_cast<double>(i);
      stretch.force_g.push_back(
          x + slope * t + 50 +
          sine_g * std::sin(2 * std::numbers::pi * sine_hz / kRate_hz * t + phase));
      x = correlation * x + std::sqrt(1 - correlation * correlation) * random.Normal();
    }
    stretches.push_back(std::move(stretch));
  }
  return stretches;
}

std::vector<double> Noise(const NoiseModel& model, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  NoiseDraw draw(model, random);
  std::vector<double> noise;
  for (std::size_t i = 0; i < count; ++i) noise.push_back(draw.Next());
  return noise;
}

double Correlation(const std::vector<double>& x, std::size_t lag) {
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    squares += x[i] * x[i];
    if (i >= lag) sum += x[i] * x[i - lag];
  }
  return sum / squares;
}

TEST(NoiseModel, WhiteNoiseStaysWhite) {
  Random random(1);
  const NoiseModel model = FitNoiseModel(Draw(0, 0, 0, random), {}, 7);
  // 4000 samples know a deviation to 1.1 %, a correlation to 0.016.
  EXPECT_NEAR(model.deviation_g, 1, 0.08);
  EXPECT_NEAR(model.approach_deviation_g, 1, 0.08);
  EXPECT_NEAR(Correlation(Noise(model, 20'000, 2), 1), 0, 0.08);
}

TEST(NoiseModel, DrawsTheCorrelationItWasFittedTo) {
  for (const double correlation : {0.8, 0.4, -0.5}) {
    Random random(3);
    const NoiseModel model = FitNoiseModel(Draw(correlation, 0, 0, random), {}, 7);
    const std::vector<double> noise = Noise(model, 50'000, 4);
    EXPECT_NEAR(StandardDeviation(noise), 1, 0.05) << correlation;
    // Less each stretch's line, correlated noise of 200 samples loses some of it.
    EXPECT_NEAR(Correlation(noise, 1), correlation, 0.08) << correlation;
    EXPECT_NEAR(Correlation(noise, 3), std::pow(correlation, 3), 0.12) << correlation;
  }
}

TEST(NoiseModel, TakesTheSpectrumsLinesOutOfTheNoise) {
  Random random(5);
  NoiseSpectrum spectrum;
  spectrum.sample_rate_hz = kRate_hz;
  spectrum.lines.push_back({50, 3, NoiseSource::kMains50Hz, 1, 50});
  const NoiseModel model = FitNoiseModel(Draw(0, 3, 50, random), spectrum, 7);
  ASSERT_EQ(model.sines.size(), 1u);
  EXPECT_EQ(model.sines[0].amplitude_g, 3);
  EXPECT_NEAR(model.deviation_g, 1, 0.15);
  EXPECT_NEAR(Correlation(Noise(model, 20'000, 6), 1), 0, 0.15);
}

TEST(NoiseModel, WithoutStretchesItIsWhiteOfTheDeviationGiven) {
  const std::vector<FreeStretch> brief{{{1, 2, 3}, false}};
  for (const auto& stretches : {std::vector<FreeStretch>{}, brief}) {
    const NoiseModel model = FitNoiseModel(stretches, {}, 7);
    EXPECT_EQ(model.deviation_g, 7);
    EXPECT_EQ(model.approach_deviation_g, 7);
    EXPECT_TRUE(model.regression.empty());
  }
}

TEST(NoiseModel, BearsStretchesWithoutNoise) {
  const std::vector<FreeStretch> still{{std::vector<double>(100, 5.0), false}};
  const NoiseModel model = FitNoiseModel(still, {}, 0);
  EXPECT_NEAR(model.deviation_g, 0, 1e-9);  // rounding
}

}  // namespace
}  // namespace trammel::tap

// The variance that CorrelatedFactor predicts, against that of many breaks fitted in noise with a
// memory.
#include "tap/contact/correlated_break.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "tap/contact/press_profile.h"

namespace trammel::tap {
namespace {

constexpr double kBreak = 0.4537;
constexpr double kNoise_g = 1;

// First-order regression of unit variance.
std::vector<double> Noise(std::size_t n, double memory, Random& random) {
  std::vector<double> noise(n);
  double last = random.Normal();
  for (double& value : noise) {
    value = last;
    last = memory * last + std::sqrt(1 - memory * memory) * random.Normal();
  }
  return noise;
}

struct Fitted {
  double t = 0;
  double noise = 0;
  std::vector<double> y;
  std::vector<double> residual;

  [[nodiscard]] BreakFit View() const { return {y, residual, t, noise}; }
};

// The quadratic press of least squares: the break by its profile, without the weights under test.
Fitted FitIn(const std::vector<double>& noise) {
  const std::size_t n = noise.size();
  Fitted fitted;
  std::vector<double> force(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double y = static_cast<double>(i) / static_cast<double>(n - 1);
    const double d = std::max(0.0, kBreak - y);
    fitted.y.push_back(y);
    force[i] = 20 * y + 400 * d + 100 * d * d + kNoise_g * noise[i];
  }
  std::vector<std::byte> memory(1 << 17);
  Workspace workspace(memory);
  const PressProfile profile({fitted.y, force, {}}, workspace);
  const auto rest = [&profile](double t) { return profile.Evaluate(t).sum_squares[1]; };
  double best = kBreak;
  for (double step = 0.01; step > 1e-5; step /= 4) {
    const double centre = best;
    for (int i = -8; i <= 8; ++i) {
      const double t = centre + i * step;
      best = rest(t) < rest(best) ? t : best;
    }
  }
  fitted.t = best;
  fitted.noise = std::sqrt(rest(best) / static_cast<double>(n - 5));
  const auto [a, b, c] = profile.Fit(best, 2);
  for (std::size_t i = 0; i < n; ++i) {
    const double d = std::max(0.0, best - fitted.y[i]);
    fitted.residual.push_back(force[i] - a - b * (fitted.y[i] - best) - d * (c[0] + d * c[1]));
  }
  return fitted;
}

double Factor(const Fitted& fitted, std::vector<std::vector<double>> free) {
  std::vector<std::span<double>> stretches(free.begin(), free.end());
  std::vector<std::byte> memory(1 << 17);
  Workspace workspace(memory);
  return CorrelatedFactor(fitted.View(), stretches, workspace);
}

struct Outcome {
  double observed = 0;   // variance of the break
  double predicted = 0;  // mean of factor * noise^2, times the variance for white unit noise
  double mean_factor = 0;
  double covered = 0;  // share of breaks within 1.96 predicted deviations
};

// Variance of the break for white noise of 1 gf.
double WhiteVariance(std::size_t n, int taps) {
  std::vector<double> t;
  for (int i = 0; i < taps; ++i) {
    Random random(5000 + i);
    t.push_back(FitIn(Noise(n, 0, random)).t);
  }
  return std::pow(StandardDeviation(t), 2);
}

Outcome Simulate(std::size_t n, double memory, std::size_t free, int taps, double white) {
  Outcome outcome;
  std::vector<double> t;
  for (int i = 0; i < taps; ++i) {
    Random random(1000 + i);
    const Fitted fitted = FitIn(Noise(n, memory, random));
    const double factor =
        Factor(fitted, {Noise(free, memory, random), Noise(free, memory, random)});
    const double variance = factor * fitted.noise * fitted.noise * white;
    t.push_back(fitted.t);
    outcome.predicted += variance / taps;
    outcome.mean_factor += factor / taps;
    outcome.covered += (std::abs(fitted.t - kBreak) < 1.96 * std::sqrt(variance)) / double(taps);
  }
  outcome.observed = std::pow(StandardDeviation(t), 2);
  return outcome;
}

constexpr int kTaps = 1000;

TEST(CorrelatedBreak, PredictsTheScatterOfBreaksInNoiseWithAMemory) {
  // Stretches so long that the variogram is known: what is left is the scatter of both observed
  // variances, each known to sqrt(2 / taps), three times of which is granted, and that the fits are
  // not quite linear in the noise.
  const double most = 3 * std::sqrt(4.0 / kTaps) + 0.03;
  constexpr std::size_t kLong = 4000;
  for (const std::size_t samples : {100, 250}) {  // one to a block, and two
    const double white = WhiteVariance(samples, kTaps);
    for (const double memory : {0.5, 0.8, 0.95}) {
      const Outcome outcome = Simulate(samples, memory, kLong, kTaps, white);
      EXPECT_NEAR(outcome.predicted / outcome.observed, 1, most)
          << samples << " samples, memory " << memory;
      EXPECT_GT(outcome.mean_factor, 2) << "or white noise would do";
    }
  }
}

TEST(CorrelatedBreak, IsOneForWhiteNoise) {
  // The factor scatters by a tenth with stretches of this length; what lies below 1 is cut off.
  constexpr std::size_t kLong = 4000;
  for (const std::size_t samples : {100, 250}) {
    const Outcome outcome = Simulate(samples, 0, kLong, 300, 1);
    EXPECT_GE(outcome.mean_factor, 1);
    EXPECT_LT(outcome.mean_factor, 1.1) << samples << " samples";
  }
}

TEST(CorrelatedBreak, ShortStretchesStillCoverNineBreaksInTen) {
  // Uses stretches as long as a tap's. The variogram is then poorly known, for which Student's
  // quantile corrects in part: 91 to 96 % are covered.
  constexpr std::size_t kShort = 200;
  for (const std::size_t samples : {100, 250}) {
    const double white = WhiteVariance(samples, kTaps);
    for (const double memory : {0.0, 0.5, 0.8, 0.95}) {
      EXPECT_GE(Simulate(samples, memory, kShort, kTaps, white).covered, 0.9)
          << samples << " samples, memory " << memory;
    }
  }
}

}  // namespace
}  // namespace trammel::tap

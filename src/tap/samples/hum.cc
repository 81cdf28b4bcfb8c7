#include "tap/samples/hum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace trammel::tap {
namespace {

constexpr std::array<double, 4> kLines_hz = {50, 60, 100, 120};
constexpr double kFalseAlarm = 1e-4;
constexpr double kLeastOfNoise = 0.5;
// Fewer periods than these on the flat part are told from a slope or from each other by chance.
constexpr double kLeastPeriods = 3;
constexpr double kSamePlace_hz = 1.0;

double Fold(double frequency_hz, double rate_hz) {
  const double folded = std::fmod(frequency_hz, rate_hz);
  return folded > rate_hz / 2 ? rate_hz - folded : folded;
}

struct Power {
  std::array<float, kLines_hz.size()> amplitude{};
  double noise_g2 = 0;  // with all the power in it
};

// Rotates a phasor per line from sample to sample; single precision keeps it true to 10^-4 over
// thousands of samples, and the four lines run side by side.
Power FitSines(const Samples& samples, std::size_t first, std::size_t end, const LineFit& line,
               double period_s) {
  std::array<float, kLines_hz.size()> c;
  std::array<float, kLines_hz.size()> s{};
  std::array<float, kLines_hz.size()> step_c;
  std::array<float, kLines_hz.size()> step_s;
  std::array<float, kLines_hz.size()> sum_c{};
  std::array<float, kLines_hz.size()> sum_s{};
  c.fill(1);
  for (std::size_t k = 0; k < kLines_hz.size(); ++k) {
    const double angle = 2 * std::numbers::pi * kLines_hz[k] * period_s;
    step_c[k] = static_cast<float>(std::cos(angle));
    step_s[k] = static_cast<float>(std::sin(angle));
  }
  float squares = 0;
  for (std::size_t i = first; i < end; ++i) {
    const auto residual = static_cast<float>(samples.force_g[i] - line.Force(samples.time_s[i]));
    squares += residual * residual;
    for (std::size_t k = 0; k < kLines_hz.size(); ++k) {
      sum_c[k] += residual * c[k];
      sum_s[k] += residual * s[k];
      const float turned = c[k] * step_c[k] - s[k] * step_s[k];
      s[k] = s[k] * step_c[k] + c[k] * step_s[k];
      c[k] = turned;
    }
  }
  const auto n = static_cast<double>(end - first);
  Power power;
  power.noise_g2 = squares / n;
  for (std::size_t k = 0; k < kLines_hz.size(); ++k) {
    power.amplitude[k] = static_cast<float>(2 / n * std::hypot(sum_c[k], sum_s[k]));
  }
  return power;
}

}  // namespace

Hum FindHum(const Samples& samples, std::size_t first, std::size_t end, const LineFit& line,
            double period_s) {
  Hum hum;
  if (end < first + 8 || !(period_s > 0)) {
    return hum;
  }
  const Power power = FitSines(samples, first, end, line, period_s);
  const auto n = static_cast<double>(end - first);
  const double threshold = std::log(static_cast<double>(kLines_hz.size()) / kFalseAlarm);
  for (std::size_t k = 0; k < kLines_hz.size(); ++k) {
    const double seen_hz = Fold(kLines_hz[k], 1 / period_s);
    const double amplitude = power.amplitude[k];
    const double rest_g2 = std::max(power.noise_g2 - amplitude * amplitude / 2, 0.0);
    // Neither to be told from a slope, nor from a sign that flips with every sample.
    const double from_end_hz = std::min(seen_hz, 0.5 / period_s - seen_hz);
    if (from_end_hz * n * period_s < kLeastPeriods || amplitude <= hum.amplitude_g ||
        amplitude * amplitude * n <= 4 * threshold * rest_g2 ||
        amplitude * amplitude <= kLeastOfNoise * kLeastOfNoise * rest_g2) {
      continue;
    }
    hum = {kLines_hz[k], seen_hz, amplitude, 0};
  }
  for (const double other_hz : kLines_hz) {
    if (hum.mains_hz > 0 && other_hz != hum.mains_hz &&
        std::abs(Fold(other_hz, 1 / period_s) - hum.seen_hz) < kSamePlace_hz) {
      hum.ambiguous_hz = other_hz;
    }
  }
  return hum;
}

}  // namespace trammel::tap

#include "tap/samples/hum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

namespace trammel::tap {
namespace {

constexpr std::array<double, 4> kLines_hz = {50, 60, 100, 120};
constexpr double kFalseAlarm = 1e-4;
constexpr double kMinOfNoise = 0.5;
// Minimum number of periods on the flat part: fewer are not distinguishable from a slope or from
// each other.
constexpr double kMinPeriods = 3;

double Fold(double frequency_hz, double rate_hz) {
  const double folded = std::fmod(frequency_hz, rate_hz);
  return folded > rate_hz / 2 ? rate_hz - folded : folded;
}

struct Power {
  std::array<double, kLines_hz.size()> amplitude{};
  double noise_g2 = 0;  // including all power
};

Power FitSines(const Samples& samples, std::size_t first, std::size_t end, const LineFit& line,
               double period_s) {
  const auto n = static_cast<double>(end - first);
  Power power;
  std::array<std::complex<double>, kLines_hz.size()> sums{};
  for (std::size_t i = first; i < end; ++i) {
    const double residual = samples.force_g[i] - line.Force(samples.time_s[i]);
    power.noise_g2 += residual * residual / n;
    const double turns = 2 * std::numbers::pi * period_s * static_cast<double>(i - first);
    for (std::size_t k = 0; k < kLines_hz.size(); ++k) {
      sums[k] += residual * std::polar(1.0, kLines_hz[k] * turns);
    }
  }
  for (std::size_t k = 0; k < kLines_hz.size(); ++k) {
    power.amplitude[k] = 2 / n * std::abs(sums[k]);
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
    // Not distinguishable from a slope, or from a sign that flips with every sample.
    const double from_end_hz = std::min(seen_hz, 0.5 / period_s - seen_hz);
    if (from_end_hz * n * period_s < kMinPeriods || amplitude <= hum.amplitude_g ||
        amplitude * amplitude * n <= 4 * threshold * rest_g2 ||
        amplitude * amplitude <= kMinOfNoise * kMinOfNoise * rest_g2) {
      continue;
    }
    hum = {kLines_hz[k], seen_hz, amplitude};
  }
  return hum;
}

}  // namespace trammel::tap

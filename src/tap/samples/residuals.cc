#include "tap/samples/residuals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

constexpr double kMedianOfNormal = 0.6745;
// Minimum power of a line over that of white noise, which is exponential with mean 1. Six lines are
// tested, and only if the residuals are not white: one false line in 30,000 taps.
constexpr double kMinLinePower = 12;

struct Line {
  double cosine = 0;
  double sine = 0;
};
using Lines = std::array<Line, MainsHum::kLines>;

// Calls visit(i, k, cosine, sine) for every sample and the first `count` harmonics of a frequency.
template <class Visit>
void ForHarmonics(std::span<const double> time_s, double frequency_hz, std::size_t count,
                  const Visit& visit) {
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double angle = 2 * std::numbers::pi * frequency_hz * (time_s[i] - time_s[0]);
    for (std::size_t k = 0; k < count; ++k) {
      const double of_harmonic = static_cast<double>(k + 1) * angle;
      visit(i, k, std::cos(of_harmonic), std::sin(of_harmonic));
    }
  }
}

// Computes amplitudes of a frequency's harmonics by projection: the samples span several periods,
// over which cosine and sine are nearly orthogonal.
Lines Project(std::span<const double> time_s, std::span<const double> r, double frequency_hz,
              std::size_t count) {
  Lines lines;
  const double scale = 2 / static_cast<double>(r.size());
  ForHarmonics(time_s.first(r.size()), frequency_hz, count,
               [&](std::size_t i, std::size_t k, double c, double s) {
                 lines[k].cosine += scale * r[i] * c;
                 lines[k].sine += scale * r[i] * s;
               });
  return lines;
}

using OfLags = std::array<double, kLags + 1>;

// Adds r_i r_(i-k) for i = first … end - 1 and all lags.
void Correlate(std::span<const double> r, std::size_t first, std::size_t end, OfLags& sum) {
  for (std::size_t i = first; i < end; ++i) {
    for (std::size_t lag = 0; lag <= std::min<std::size_t>(i, kLags); ++lag) {
      sum[lag] += r[i] * r[i - lag];
    }
  }
}

// Computes 1 + 2 sum of rho_k up to the first that is not significant.
double SumCorrelation(const OfLags& sum, std::size_t n) {
  const double significant = 1.5 / std::sqrt(static_cast<double>(n));
  double factor = 1;
  for (std::size_t lag = 1; lag <= kLags && sum[lag] > significant * sum[0]; ++lag) {
    factor += 2 * sum[lag] / sum[0];
  }
  return factor;
}

double BoxPierce(const OfLags& sum, std::size_t n) {
  double squares = 0;
  for (std::size_t lag = 1; lag <= kLags; ++lag) {
    squares += static_cast<double>(n) * sum[lag] * sum[lag] / (sum[0] * sum[0]);
  }
  return squares;
}

}  // namespace

bool ResidualTraits::White() const {
  constexpr double kMaxSurplus = 3.5;  // standard deviations
  return portmanteau < kPortmanteauLimit && press_surplus < kMaxSurplus;
}

double ResidualTraits::Inflation() const {
  constexpr double kDoubtful = 15.5;  // portmanteau limit: white noise reaches it in 5 %
  const double noise = portmanteau > kDoubtful ? correlation : 1;
  const double misfit = White() ? 1 : press_ratio * press_correlation;
  return std::max({1.0, noise, misfit});
}

ResidualTraits Examine(std::span<const double> r, std::size_t below, std::span<double> scratch) {
  ResidualTraits traits;
  const std::size_t n = r.size();
  constexpr std::size_t kMinInPress = 5;
  if (n <= kLags || below < kMinInPress || below + kMinInPress > n) {
    return traits;
  }
  OfLags press{};
  Correlate(r, 0, below, press);
  OfLags all = press;
  Correlate(r, below, n, all);
  for (const double value : r) {
    traits.largest = std::max(traits.largest, std::abs(value));
  }
  constexpr double kMinOfRms = 0.75;
  const double rms = std::sqrt(all[0] / static_cast<double>(n));
  traits.robust_deviation = kMinOfRms * rms;
  constexpr double kOfInterest = 3;  // no median is asked for where nothing lies far off
  if (traits.largest > kOfInterest * rms) {
    std::transform(r.begin(), r.end(), scratch.begin(), [](double v) { return std::abs(v); });
    const double median = UpperMedian(scratch.first(n));
    traits.robust_deviation = std::max(median / kMedianOfNormal, kMinOfRms * rms);
  }
  const double beyond = all[0] - press[0];
  if (!(press[0] > 0) || !(beyond > 0)) {
    return traits;
  }
  constexpr double kPressUnknowns = 3;
  constexpr double kBaselineUnknowns = 2;
  const double n_press = static_cast<double>(below) - kPressUnknowns;
  const double n_beyond = static_cast<double>(n - below) - kBaselineUnknowns;
  traits.press_ratio = press[0] / n_press * (n_press + n_beyond) / all[0];
  traits.press_surplus =
      std::log(press[0] / n_press * n_beyond / beyond) / std::sqrt(2 / n_press + 2 / n_beyond);
  traits.portmanteau = BoxPierce(all, n);
  traits.correlation = SumCorrelation(all, n);
  traits.press_correlation = SumCorrelation(press, below);
  return traits;
}

std::size_t WeighOutliers(std::span<const double> r, double deviation, std::span<double> weight) {
  constexpr double kFar = 3;   // deviations
  constexpr double kGone = 6;  // deviations
  std::size_t forgotten = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double before = i > 0 ? std::abs(r[i - 1]) : 0;
    const double after = i + 1 < r.size() ? std::abs(r[i + 1]) : 0;
    const bool alone = std::max(before, after) < kFar * deviation;
    const double beyond =
        alone ? std::clamp((std::abs(r[i]) / deviation - kFar) / (kGone - kFar), 0.0, 1.0) : 0;
    weight[i] = (1 - beyond * beyond) * (1 - beyond * beyond);
    forgotten += weight[i] < 0.5 ? 1 : 0;
  }
  return forgotten;
}

MainsHum FindMainsHum(std::span<const double> time_s, std::span<const double> r, double deviation) {
  MainsHum hum;
  double best = kMinLinePower;
  for (const double frequency_hz : {50.0, 60.0}) {
    const Lines lines = Project(time_s, r, frequency_hz, MainsHum::kLines);
    const double unit = static_cast<double>(r.size()) / (4 * deviation * deviation);
    std::array<double, MainsHum::kLines> power{};
    for (std::size_t k = 0; k < lines.size(); ++k) {
      power[k] = unit * (lines[k].cosine * lines[k].cosine + lines[k].sine * lines[k].sine);
    }
    const double strongest = *std::max_element(power.begin(), power.end());
    if (strongest > best) {
      best = strongest;
      hum.frequency_hz = frequency_hz;
      hum.amplitude_g = std::sqrt(strongest / unit);
      for (std::size_t k = 0; k < power.size(); ++k) {
        hum.present[k] = power[k] > kMinLinePower;
      }
    }
  }
  return hum;
}

void RemoveMainsHum(const MainsHum& hum, std::span<const double> time_s, std::span<double> r,
                    std::span<double> force) {
  std::size_t count = hum.present.size();
  while (count > 0 && !hum.present[count - 1]) {
    --count;
  }
  Lines lines = Project(time_s, r, hum.frequency_hz, count);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    lines[k] = hum.present[k] ? lines[k] : Line{};
  }
  ForHarmonics(time_s.first(r.size()), hum.frequency_hz, count,
               [&](std::size_t i, std::size_t k, double c, double s) {
                 const double wave = lines[k].cosine * c + lines[k].sine * s;
                 r[i] -= wave;
                 force[i] -= wave;
               });
}

}  // namespace trammel::tap

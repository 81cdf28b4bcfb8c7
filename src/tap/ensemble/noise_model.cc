#include "tap/ensemble/noise_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::tap {
namespace {

constexpr std::size_t kMostOrder = 12;
constexpr std::size_t kLeastSamples = 16;
/// Of the variance that stays noise, however strong the lines of the spectrum are.
constexpr double kLeastRest = 0.02;

struct Covariances {
  std::vector<double> sums = std::vector<double>(kMostOrder + 1);
  double samples = 0;
  [[nodiscard]] double At(std::size_t lag) const { return sums[lag] / samples; }
};

/// Adds the products of a stretch's residuals about its own line. The line takes two degrees of
/// freedom, which the variance gets back.
void Add(std::vector<double> force_g, Covariances& all) {
  const std::size_t n = force_g.size();
  if (n < kLeastSamples) return;
  const double middle = 0.5 * static_cast<double>(n - 1);
  double mean = 0;
  double tf = 0;
  double tt = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) - middle;
    mean += force_g[i] / static_cast<double>(n);
    tf += t * force_g[i];
    tt += t * t;
  }
  for (std::size_t i = 0; i < n; ++i) {
    force_g[i] -= mean + tf / tt * (static_cast<double>(i) - middle);
  }
  for (std::size_t lag = 0; lag <= kMostOrder; ++lag) {
    double sum = 0;
    for (std::size_t i = lag; i < n; ++i) sum += force_g[i] * force_g[i - lag];
    all.sums[lag] += sum;
  }
  all.samples += static_cast<double>(n) - 2;
}

/// Levinson-Durbin on correlations (1 at lag 0), up to the order that Akaike's criterion takes.
void FitRegression(const std::vector<double>& correlation, double samples, NoiseModel& model) {
  std::vector<double> now;
  double error = 1;
  double best = 0;
  for (std::size_t order = 1; order <= kMostOrder; ++order) {
    double reflection = correlation[order];
    for (std::size_t k = 0; k < now.size(); ++k) reflection -= now[k] * correlation[order - 1 - k];
    reflection /= error;
    if (!(std::abs(reflection) < 1)) return;
    std::vector<double> next = now;
    for (std::size_t k = 0; k < now.size(); ++k) next[k] -= reflection * now[now.size() - 1 - k];
    next.push_back(reflection);
    now = std::move(next);
    error *= 1 - reflection * reflection;
    const double criterion = samples * std::log(error) + 2 * static_cast<double>(order);
    if (criterion < best) {
      best = criterion;
      model.regression = now;
      model.innovation = std::sqrt(error);
    }
  }
}

}  // namespace

NoiseModel FitNoiseModel(std::span<const FreeStretch> stretches, const NoiseSpectrum& spectrum,
                         double otherwise_g) {
  NoiseModel model;
  model.deviation_g = model.approach_deviation_g = otherwise_g;
  Covariances all;
  Covariances down;
  Covariances up;
  for (const FreeStretch& stretch : stretches) {
    Add(stretch.force_g, all);
    Add(stretch.force_g, stretch.approach ? down : up);
  }
  if (!(all.samples > 0) || !(all.At(0) > 0)) return model;
  std::vector<double> rest(kMostOrder + 1);
  for (std::size_t lag = 0; lag <= kMostOrder; ++lag) rest[lag] = all.At(lag);
  for (const NoiseLine& line : spectrum.lines) {
    const double power = 0.5 * line.amplitude_g * line.amplitude_g;
    const double turn = 2 * std::numbers::pi * line.frequency_hz / spectrum.sample_rate_hz;
    if (!(rest[0] - power > kLeastRest * all.At(0))) continue;
    for (std::size_t lag = 0; lag <= kMostOrder; ++lag) {
      rest[lag] -= power * std::cos(turn * static_cast<double>(lag));
    }
    model.sines.push_back({line.frequency_hz, line.amplitude_g});
  }
  const double of_sines = all.At(0) - rest[0];
  const auto deviation = [&](const Covariances& part) {
    return part.samples > 0 ? std::sqrt(std::max(part.At(0) - of_sines, kLeastRest * part.At(0)))
                            : std::sqrt(rest[0]);
  };
  model.deviation_g = deviation(up);
  model.approach_deviation_g = deviation(down);
  std::vector<double> correlation = rest;
  for (double& value : correlation) value /= rest[0];
  FitRegression(correlation, all.samples, model);
  return model;
}

NoiseDraw::NoiseDraw(const NoiseModel& model, Random& random)
    : model_(model), random_(random), past_(model.regression.size()) {
  // The filter has forgotten its start after some of its lengths.
  constexpr std::size_t kLengths = 20;
  for (std::size_t i = 0; i < kLengths * past_.size(); ++i) (void)Next();
}

double NoiseDraw::Next() {
  double x = model_.innovation * random_.Normal();
  const std::size_t order = past_.size();
  for (std::size_t k = 0; k < order; ++k) x += model_.regression[k] * past_[(at_ + k) % order];
  if (order > 0) {
    at_ = (at_ + order - 1) % order;
    past_[at_] = x;
  }
  return x;
}

}  // namespace trammel::tap

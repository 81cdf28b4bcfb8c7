#include "base/statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/check.h"

namespace trammel {

double Median(std::span<const double> sample) { return Quantile(sample, 0.5); }

double RobustStandardDeviation(std::span<const double> sample) {
  if (sample.size() < 2) return 0;
  const double centre = Median(sample);
  std::vector<double> distance(sample.begin(), sample.end());
  for (double& value : distance) value = std::abs(value - centre);
  return 1.4826 * Median(distance);
}

double Mean(std::span<const double> sample) {
  TRAMMEL_CHECK(!sample.empty(), "the sample is empty");
  return std::accumulate(sample.begin(), sample.end(), 0.0) / static_cast<double>(sample.size());
}

double StandardDeviation(std::span<const double> sample) {
  if (sample.size() < 2) return 0;
  const double mean = Mean(sample);
  double sum = 0;
  for (const double value : sample) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(sample.size() - 1));
}

double Quantile(std::span<const double> sample, double probability) {
  TRAMMEL_CHECK(!sample.empty() && probability >= 0 && probability <= 1,
                "{} values, probability = {}", sample.size(), probability);
  std::vector<double> values(sample.begin(), sample.end());
  const double rank = probability * static_cast<double>(values.size() - 1);
  const double whole = std::floor(rank);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(whole);
  std::nth_element(values.begin(), at, values.end());
  const double below = *at;
  const double above = at + 1 == values.end() ? below : *std::min_element(at + 1, values.end());
  return below + (rank - whole) * (above - below);
}

double LogGamma(double x) {
  int sign = 0;
  return ::lgamma_r(x, &sign);
}

double StudentT95(double degrees_of_freedom) {
  TRAMMEL_CHECK(degrees_of_freedom > 0, "degrees_of_freedom = {}", degrees_of_freedom);
  const double n = degrees_of_freedom;
  if (n > 100) {
    // Expansion about the normal quantile (Abramowitz & Stegun 26.7.5); error below 1e-7.
    constexpr double z = 1.959963984540054;
    constexpr double z2 = z * z;
    const double third = (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n);
    return z * (1 + ((z2 + 1) / 4 + (((5 * z2 + 16) * z2 + 3) / 96 + third) / n) / n);
  }
  // P(|T| <= t) by integrating the density in theta = atan(t / sqrt(n)), where it becomes
  // proportional to cos^(n-1)(theta); Newton on theta, bisected where it leaps out. The fixed grid
  // resolves n up to 1e4.
  const auto integral = [n](double theta) {
    constexpr int kSteps = 400;  // Simpson; error below 1e-9 for n >= 1
    const double h = theta / kSteps;
    double sum = 0;
    for (int i = 0; i <= kSteps; ++i) {
      const double weight = (i == 0 || i == kSteps) ? 1 : (i % 2 == 1 ? 4 : 2);
      sum += weight * std::pow(std::cos(h * i), n - 1);
    }
    return sum * h / 3;
  };
  const double whole =
      std::exp(LogGamma(n / 2) - LogGamma((n + 1) / 2)) * std::sqrt(std::numbers::pi) / 2;
  double lo = 0;
  double hi = std::numbers::pi / 2;
  double theta = std::atan(2 / std::sqrt(n));
  for (int i = 0; i < 60; ++i) {
    const double missing = 0.95 * whole - integral(theta);
    (missing > 0 ? lo : hi) = theta;
    const double before = theta;
    theta += missing / std::pow(std::cos(theta), n - 1);
    if (!(theta > lo && theta < hi)) theta = (lo + hi) / 2;
    if (std::abs(theta - before) < 1e-14 * theta) break;
  }
  return std::sqrt(n) * std::tan(theta);
}

}  // namespace trammel

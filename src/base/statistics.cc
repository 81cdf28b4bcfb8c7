#include "base/statistics.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numeric>

#include "base/check.h"

namespace trammel {

double Median(std::span<const double> sample) { return Quantile(sample, 0.5); }

double MedianSlope(std::span<const double> x, std::span<const double> y) {
  TRAMMEL_CHECK(x.size() == y.size(), "{} and {} values", x.size(), y.size());
  std::vector<double> slopes;
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (std::size_t j = i + 1; j < x.size(); ++j) {
      const double slope = (y[j] - y[i]) / (x[j] - x[i]);
      if (std::isfinite(slope)) slopes.push_back(slope);
    }
  }
  return slopes.empty() ? 0 : Median(slopes);
}

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

double StudentPoint(double probability, double freedom) {
  TRAMMEL_CHECK(probability > 0 && probability < 1 && freedom > 0, "probability = {}, freedom = {}",
                probability, freedom);
  double rest = 0;  // 1 - share, which would cancel for many degrees of freedom
  const double share = boost::math::ibeta_inv(0.5 * freedom, 0.5, probability, &rest);
  return std::sqrt(freedom * rest / share);
}

double StudentT95(double degrees_of_freedom) { return StudentPoint(0.05, degrees_of_freedom); }

double ChiSquareTail(double value, int freedom) {
  if (freedom < 1 || !(value > 0)) return 1;
  return boost::math::gamma_q(0.5 * freedom, 0.5 * value);
}

double ChiSquareQuantile(double probability, int freedom) {
  TRAMMEL_CHECK(probability > 0 && probability < 1 && freedom > 0, "probability = {}, freedom = {}",
                probability, freedom);
  return 2 * boost::math::gamma_p_inv(0.5 * freedom, probability);
}

}  // namespace trammel

#include "tap/contact/correlated_break.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "base/statistics.h"
#include "tap/contact/press_profile.h"
#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kMaxBlocks = 128;  // limit of the fit: longer ones are averaged in blocks
constexpr std::size_t kMinFree = 16;     // samples or blocks of a stretch
constexpr double kMinPairs = 16;         // minimum for the variogram at a lag

// Projects the columns 1, y, d, d^2 out of the step at the break (modified Gram-Schmidt).
bool BreakWeights(const BreakFit& fit, std::span<double> columns, std::span<double> w) {
  const std::size_t n = fit.y.size();
  constexpr std::size_t kColumns = 4;
  for (std::size_t i = 0; i < n; ++i) {
    const double d = std::max(0.0, fit.t - fit.y[i]);
    columns[i] = 1;
    columns[n + i] = fit.y[i] - 0.5;
    columns[2 * n + i] = d;
    columns[3 * n + i] = d * d;
    w[i] = d > 0 ? 1 : 0;
  }
  const auto product = [n](const double* a, const double* b) {
    return std::inner_product(a, a + n, b, 0.0);
  };
  for (std::size_t k = 0; k < kColumns; ++k) {
    const double* const column = &columns[k * n];
    const double square = product(column, column);
    if (!(square > 0)) {
      return false;
    }
    for (std::size_t other = k + 1; other <= kColumns; ++other) {
      double* const from = other < kColumns ? &columns[other * n] : w.data();
      const double share = product(column, from) / square;
      for (std::size_t i = 0; i < n; ++i) {
        from[i] -= share * column[i];
      }
    }
  }
  return true;
}

// Computes block means, or sums, in place.
std::span<double> Blocks(std::span<double> values, std::size_t block, bool mean) {
  const std::size_t count = values.size() / block;
  for (std::size_t b = 0; b < count; ++b) {
    double sum = 0;
    for (std::size_t i = 0; i < block; ++i) {
      sum += values[b * block + i];
    }
    values[b] = mean ? sum / static_cast<double>(block) : sum;
  }
  return values.first(count);
}

using OfLags = std::array<double, kMaxBlocks>;

struct Variogram {
  OfLags sum{};
  OfLags pairs{};

  void Add(std::span<const double> x, std::size_t lags) {
    for (std::size_t lag = 1; lag < std::min(lags, x.size()); ++lag) {
      for (std::size_t i = lag; i < x.size(); ++i) {
        sum[lag] += 0.5 * (x[i] - x[i - lag]) * (x[i] - x[i - lag]);
      }
      pairs[lag] += static_cast<double>(x.size() - lag);
    }
  }
  [[nodiscard]] bool Knows(std::size_t lag) const { return pairs[lag] >= kMinPairs; }
  [[nodiscard]] double At(std::size_t lag) const { return sum[lag] / pairs[lag]; }
};

}  // namespace

double CorrelatedFactor(const BreakFit& fit, std::span<const std::span<double>> free,
                        Workspace& workspace) {
  const std::size_t n = fit.y.size();
  const std::size_t block = (n + kMaxBlocks - 1) / kMaxBlocks;
  const Workspace::Scope scope(workspace);
  const std::span<double> columns = workspace.Take<double>(4 * n);
  const std::span<double> weights = workspace.Take<double>(n);
  if (columns.empty() || weights.empty() || !BreakWeights(fit, columns, weights)) {
    return 1;
  }
  double square = 0;
  for (const double w : weights) {
    square += w * w;
  }
  Variogram variogram;
  double contrasts = 0;
  for (const std::span<double> stretch : free) {
    if (stretch.size() >= kMinFree * block) {
      const std::span<double> means = Blocks(stretch, block, true);
      variogram.Add(means, n / block);
      contrasts += static_cast<double>(means.size());
    }
  }
  if (!variogram.Knows(1) || !(fit.noise > 0) || !(square > 0)) {
    return 1;
  }
  std::copy(fit.residual.begin(), fit.residual.end(), columns.begin());
  const std::span<double> rest = Blocks(columns.first(n), block, true);
  double nugget = 0;
  for (std::size_t i = 1; i < rest.size(); ++i) {
    nugget += 0.5 * (rest[i] - rest[i - 1]) * (rest[i] - rest[i - 1]);
  }
  nugget *= static_cast<double>(block) / static_cast<double>(rest.size() - 1);
  const std::span<double> w = Blocks(weights, block, false);
  double surplus = 0;
  double width = 1;
  double at_lag = variogram.At(1);
  for (std::size_t lag = 1; lag < w.size(); ++lag) {
    const double product = std::inner_product(&w[lag], &w[0] + w.size(), &w[0], 0.0);
    at_lag = variogram.Knows(lag) ? variogram.At(lag) : at_lag;
    surplus -= 2 * product * (at_lag - variogram.At(1));
    const double share = product / (static_cast<double>(block) * square);
    width += 2 * share * share;
  }
  const double factor = (nugget + surplus / square) / (fit.noise * fit.noise);
  const double student = Student95(std::max(3.0, contrasts / width)) / kNormal95;
  return std::max(1.0, factor * student * student);
}

}  // namespace trammel::tap

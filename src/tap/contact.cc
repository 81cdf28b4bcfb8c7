#include "tap/contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tap/finding.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kUnknowns = 4;  // baseline, its slope, press, its curvature
constexpr std::size_t kLeastSamples = 12;
constexpr std::size_t kLeastBeside = 4;  // samples on either side of the break

struct Fit {
  double sum_squares = std::numeric_limits<double>::infinity();
  double break_z_mm = 0;
  std::array<double, kUnknowns> coefficients{};
  double precision = 0;  // of the break: reduced curvature of the sum of squares / 2
};

using Row = std::array<double, kUnknowns + 1>;

Row Basis(double z, double break_z, double force) {
  const double depth = std::max(0.0, break_z - z);
  return {1, z - break_z, depth, depth * depth, force};
}

// Cholesky elimination of the normal equations, the force as the last column.
bool Solve(std::array<Row, kUnknowns + 1>& a, Fit& fit) {
  for (std::size_t k = 0; k < kUnknowns; ++k) {
    if (!(a[k][k] > 0)) {
      return false;
    }
    for (std::size_t i = k + 1; i <= kUnknowns; ++i) {
      const double factor = a[k][i] / a[k][k];
      for (std::size_t j = i; j <= kUnknowns; ++j) {
        a[i][j] -= factor * a[k][j];
      }
    }
  }
  fit.sum_squares = std::max(0.0, a[kUnknowns][kUnknowns]);
  for (std::size_t k = kUnknowns; k-- > 0;) {
    double value = a[k][kUnknowns];
    for (std::size_t j = k + 1; j < kUnknowns; ++j) {
      value -= a[k][j] * fit.coefficients[j];
    }
    fit.coefficients[k] = value / a[k][k];
  }
  return true;
}

Fit FitAt(std::span<const double> z, std::span<const double> force, double break_z) {
  std::array<Row, kUnknowns + 1> a{};
  for (std::size_t s = 0; s < z.size(); ++s) {
    const Row row = Basis(z[s], break_z, force[s]);
    for (std::size_t i = 0; i < row.size(); ++i) {
      for (std::size_t j = i; j < row.size(); ++j) {
        a[i][j] += row[i] * row[j];
      }
    }
  }
  Fit fit;
  fit.break_z_mm = break_z;
  if (!Solve(a, fit)) {
    fit.sum_squares = std::numeric_limits<double>::infinity();
  }
  return fit;
}

Fit Search(std::span<const double> z, std::span<const double> force) {
  Fit best;
  for (std::size_t k = kLeastBeside; k + kLeastBeside < z.size(); ++k) {
    const Fit fit = FitAt(z, force, z[k]);
    if (fit.sum_squares < best.sum_squares) {
      best = fit;
    }
  }
  const double step = (z.back() - z.front()) / static_cast<double>(z.size() - 1);
  for (double width = step; width > 1e-3 * step; width /= 2) {
    for (const double side : {-1.0, 1.0}) {
      const Fit fit = FitAt(z, force, best.break_z_mm + side * width);
      if (fit.sum_squares < best.sum_squares) {
        best = fit;
      }
    }
  }
  const double up = FitAt(z, force, best.break_z_mm + step).sum_squares;
  const double down = FitAt(z, force, best.break_z_mm - step).sum_squares;
  best.precision = (up + down - 2 * best.sum_squares) / (2 * step * step);
  return best;
}

}  // namespace

std::size_t ContactWorkspaceBytes(std::size_t samples) {
  return 1024 + 4 * samples * sizeof(double);
}

void AnalyseContact(const TapView& tap, const TapMotion& motion, const TapOptions& options,
                    Workspace& workspace, TapAnalysis& result) {
  const Workspace::Scope scope(workspace);
  const std::span<double> z = workspace.Take<double>(tap.time_s.size());
  const std::span<double> force = workspace.Take<double>(tap.time_s.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < tap.time_s.size() && n < z.size(); ++i) {
    const double time_s = tap.time_s[i] - options.latency_s;
    if (time_s >= motion.cruise_start_s && time_s <= motion.cruise_end_s) {
      z[n] = motion.CruiseZ(time_s);
      force[n++] = tap.force_g[i];
    }
  }
  if (n < kLeastSamples) {
    result.reason = {FindingCode::kFewSamplesInCruise, static_cast<double>(n), kLeastSamples};
    return;
  }
  const Fit fit = Search(z.first(n), force.first(n));
  if (!(fit.precision > 0)) {
    result.verdict = Verdict::kCannotTell;
    result.reason = {FindingCode::kNoBreak, 0, 0};
    return;
  }
  const double variance = fit.sum_squares / static_cast<double>(n - kUnknowns - 1);
  const double latency_mm = options.latency_uncertainty_s * motion.pull_back_speed_mm_s;
  const double u = std::sqrt(variance / fit.precision + latency_mm * latency_mm);
  result.verdict = Verdict::kGood;
  result.contact_z_mm = fit.break_z_mm;
  result.contact_time_s = motion.CruiseTime(fit.break_z_mm) + options.latency_s;
  result.standard_uncertainty_mm = u;
  result.interval95_mm = {fit.break_z_mm - 2 * u, fit.break_z_mm + 2 * u};
  result.noise_g = std::sqrt(variance);
  result.points[result.point_count++] = {Corner::kBreak, result.contact_time_s, fit.break_z_mm,
                                         fit.coefficients[0]};
  result.force = {true,
                  z[0],
                  z[n - 1],
                  fit.break_z_mm,
                  fit.coefficients[0],
                  fit.coefficients[1],
                  {fit.coefficients[2], fit.coefficients[3], 0, 0}};
}

}  // namespace trammel::tap

#include "signal/zero_crossing.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"

namespace trammel::signal {
namespace {

// Fit at one trial crossing: linear in a = slope and b = slope * bend.
struct Trial {
  double zero = 0;
  double cut = 0;  // beyond it the response is the constant `floor`
  double floor = 0;
  double a = 0;
  double b = 0;
  double cost = 0;
};

struct Problem {
  std::span<const double> x;
  std::span<const double> y;
  std::vector<double> weight;  // robust weight over variance
  double cut = 0;
  double bend_mean = 0;
  double penalty = 0;  // factor of (b - bend_mean * a)^2
};

// A side that saturates still falls: its slope is at least a ninth of the other's.
constexpr double kMaxBend = 0.8;

double Predict(const Trial& trial, double x) {
  if (x > trial.cut) return trial.floor;
  const double u = trial.zero - x;
  return trial.a * u - trial.b * std::abs(u);
}

Trial SolveAt(const Problem& problem, double zero) {
  double uu = 0, uv = 0, vv = 0, uy = 0, vy = 0, beyond = 0, beyond_y = 0;
  for (std::size_t i = 0; i < problem.x.size(); ++i) {
    const double w = problem.weight[i];
    if (problem.x[i] > problem.cut) {
      beyond += w;
      beyond_y += w * problem.y[i];
      continue;
    }
    const double u = zero - problem.x[i];
    const double v = -std::abs(u);
    uu += w * u * u;
    uv += w * u * v;
    vv += w * v * v;
    uy += w * u * problem.y[i];
    vy += w * v * problem.y[i];
  }
  const double k = problem.penalty;
  const double m = problem.bend_mean;
  uu += k * m * m;
  uv -= k * m;
  vv += k;
  const double determinant = uu * vv - uv * uv;
  Trial trial{zero, problem.cut, beyond > 0 ? beyond_y / beyond : 0, 0, 0, 0};
  if (determinant > 0) {
    trial.a = (uy * vv - vy * uv) / determinant;
    trial.b = (vy * uu - uy * uv) / determinant;
  }
  if (std::abs(trial.b) > kMaxBend * std::abs(trial.a)) {
    const double bend = std::copysign(kMaxBend, trial.a * trial.b);
    const double square = uu + 2 * bend * uv + bend * bend * vv;
    trial.a = square > 0 ? (uy + bend * vy) / square : 0;
    trial.b = bend * trial.a;
  }
  for (std::size_t i = 0; i < problem.x.size(); ++i) {
    const double residual = problem.y[i] - Predict(trial, problem.x[i]);
    trial.cost += problem.weight[i] * residual * residual;
  }
  trial.cost += k * (trial.b - m * trial.a) * (trial.b - m * trial.a);
  return trial;
}

Trial Search(const Problem& problem, double lo, double hi) {
  constexpr int kCoarse = 160;
  const double step = (hi - lo) / kCoarse;
  Trial best = SolveAt(problem, lo);
  for (int i = 1; i <= kCoarse; ++i) {
    const Trial trial = SolveAt(problem, lo + step * i);
    if (trial.cost < best.cost) best = trial;
  }
  constexpr double kGolden = 0.6180339887498949;
  double left = best.zero - step;
  double right = best.zero + step;
  for (int i = 0; i < 40; ++i) {
    const Trial low = SolveAt(problem, right - kGolden * (right - left));
    const Trial high = SolveAt(problem, left + kGolden * (right - left));
    (low.cost < high.cost ? right : left) = low.cost < high.cost ? high.zero : low.zero;
    if (std::min(low.cost, high.cost) < best.cost) best = low.cost < high.cost ? low : high;
  }
  return best;
}

double RobustWeight(double ratio, bool redescending, double outlier_scale) {
  constexpr double kHuber = 1.345;  // 95 % efficiency at the normal distribution
  const double r = std::abs(ratio);
  if (!redescending) return r <= kHuber ? 1 : kHuber / r;
  if (r >= outlier_scale) return 0;
  const double q = 1 - (r / outlier_scale) * (r / outlier_scale);
  return q * q;
}

// Returns the scale of the residuals near the crossing: a weighted median of their magnitudes, in
// which points far from the crossing have little weight, because there the straight halves may be
// the wrong form.
double NearScale(std::span<const double> x, const std::vector<double>& residual, double zero,
                 double range) {
  std::vector<std::pair<double, double>> magnitude;  // and weight
  double total = 0;
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double far = (x[i] - zero) / (0.3 * range);
    const double weight = 1 / ((1 + far * far) * (1 + far * far));
    magnitude.emplace_back(std::abs(residual[i]), weight);
    total += weight;
    squares += weight * weight;
  }
  std::sort(magnitude.begin(), magnitude.end());
  double passed = 0;
  double median = 0;
  for (const auto& [value, weight] : magnitude) {
    passed += weight;
    median = value;
    if (passed >= total / 2) break;
  }
  // Two to three parameters were fitted: without the factor few residuals look too small.
  const double points = total * total / squares;
  return 1.4826 * median * std::sqrt(points / std::max(1.0, points - 2.5));
}

// Finds the best crossing without a constant part, or with one if justified: each point in it must
// improve the fit by more than the two parameters (cut and floor) would by chance.
Trial SearchCuts(Problem& problem, const std::vector<double>& different, double lo, double hi,
                 bool may_saturate) {
  problem.cut = std::numeric_limits<double>::infinity();
  Trial best = Search(problem, lo, hi);
  if (!may_saturate) return best;
  constexpr std::size_t kFewestKept = 4;
  constexpr std::size_t kFewestBeyond = 2;
  constexpr double kPrice = 6;  // in squared scales
  double least = best.cost;
  for (std::size_t keep = kFewestKept; keep + kFewestBeyond <= different.size(); ++keep) {
    problem.cut = (different[keep - 1] + different[keep]) / 2;
    const Trial trial = Search(problem, lo, hi);
    // A floor is below the crossing, and the crossing before the cut.
    if (trial.floor >= 0 || trial.a <= 0 || trial.zero >= different[keep - 1]) continue;
    if (trial.cost + kPrice < least) {
      least = trial.cost + kPrice;
      best = trial;
    }
  }
  return best;
}

std::vector<double> SortedDifferent(std::span<const double> x) {
  std::vector<double> different(x.begin(), x.end());
  std::sort(different.begin(), different.end());
  different.erase(std::unique(different.begin(), different.end()), different.end());
  return different;
}

// Fit with its robust weights.
struct WeightedFit {
  Trial best;
  std::vector<double> residual;       // residuals of y
  std::vector<double> robust_weight;  // in [0, 1]
  std::vector<double> weight;         // robust weight over variance
};

// Computes robust weights for the next fit from this one's residuals.
void Reweight(std::span<const double> sigma, const ZeroCrossingOptions& options, bool redescending,
              double range, Problem& problem, WeightedFit& fit) {
  const Trial& best = fit.best;
  const std::span<const double> x = problem.x;
  for (std::size_t i = 0; i < x.size(); ++i) fit.residual[i] = problem.y[i] - Predict(best, x[i]);
  const double scale = std::max(options.scale_floor, NearScale(x, fit.residual, best.zero, range));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double far = options.distance_sigma * best.a * (x[i] - best.zero);
    const double total = std::hypot(scale, sigma[i], far);
    fit.robust_weight[i] =
        RobustWeight(fit.residual[i] / total, redescending, options.outlier_scale);
    problem.weight[i] = fit.robust_weight[i] / (total * total);
  }
  const double bend_sigma = options.bend_sigma * std::max(std::abs(best.a), 1e-12);
  problem.penalty = 1 / (bend_sigma * bend_sigma);
}

WeightedFit Iterate(std::span<const double> x, std::span<const double> y,
                    std::span<const double> sigma, const std::vector<double>& different,
                    const ZeroCrossingOptions& options) {
  const std::size_t n = x.size();
  const double range = different.back() - different.front();
  Problem problem{x, y, std::vector<double>(n), 0, options.bend_mean, 0};
  // Initial scale: one at which nothing is an outlier and nothing saturates.
  const double first_scale = std::max(options.scale_floor, RobustStandardDeviation(y));
  for (double& weight : problem.weight) weight = 1 / (first_scale * first_scale);
  WeightedFit fit{{}, std::vector<double>(n), std::vector<double>(n, 1.0), {}};
  constexpr int kIterations = 14;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    fit.best = SearchCuts(problem, different, different.front() - range / 2,
                          different.back() + range / 2, options.may_saturate);
    Reweight(sigma, options, iteration >= kIterations / 2, range, problem, fit);
  }
  fit.weight = std::move(problem.weight);
  return fit;
}

// Computes the crossing's uncertainty from the points' scatter and the prior of the bend: the
// normal equations of crossing, slope and slope * bend, linearised at the fit.
void AddUncertainty(std::span<const double> x, const WeightedFit& fit,
                    const ZeroCrossingOptions& options, ZeroCrossing& result) {
  const Trial& best = fit.best;
  result.influence.assign(x.size(), 0);
  const auto gradient = [&best](double at) {
    const double u = best.zero - at;
    return Eigen::Vector3d(best.a - std::copysign(best.b, u), u, -std::abs(u));
  };
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double heaviest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] > best.cut) continue;
    information += fit.weight[i] * gradient(x[i]) * gradient(x[i]).transpose();
    heaviest = std::max(heaviest, fit.weight[i]);
  }
  // Replaces the expected weights by those of the actual residuals.
  const double expected = std::max(heaviest * Square(result.residual_scale), 1e-300);
  information /= expected;
  const double bend_sigma = options.bend_sigma * std::max(std::abs(best.a), 1e-12);
  const Eigen::Vector3d prior(0, -options.bend_mean, 1);
  const Eigen::LDLT<Eigen::Matrix3d> solver(information +
                                            prior * prior.transpose() / Square(bend_sigma));
  if (solver.info() != Eigen::Success || !solver.isPositive()) return;
  const Eigen::Vector3d row = solver.solve(Eigen::Vector3d::UnitX());
  result.zero_sigma = std::sqrt(std::max(0.0, row.dot(information * row)));
  result.bend_shift = std::abs(row.dot(prior)) / bend_sigma;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] > best.cut) continue;
    result.influence[i] = fit.weight[i] / expected * row.dot(gradient(x[i]));
  }
}

// Computes the effective number of points, their scatter, and the slope's uncertainty from it.
void AddScatter(std::span<const double> x, const WeightedFit& fit, double scale_floor,
                ZeroCrossing& result) {
  // Weights relative to the heaviest point, so that they count points.
  std::vector<double> count(fit.weight);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] <= fit.best.cut) continue;
    count[i] = 0;
    ++result.saturated;
  }
  const double heaviest = std::max(1e-300, *std::max_element(count.begin(), count.end()));
  for (double& c : count) c /= heaviest;
  double counts = 0, squares = 0, mean = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    counts += count[i];
    squares += count[i] * fit.residual[i] * fit.residual[i];
    mean += count[i] * x[i];
  }
  mean /= counts;
  result.points = counts;
  result.residual_scale = std::max(scale_floor, std::sqrt(squares / std::max(1.0, counts - 2)));
  double spread = 0;
  for (std::size_t i = 0; i < x.size(); ++i) spread += count[i] * (x[i] - mean) * (x[i] - mean);
  result.slope_sigma = spread > 0 ? result.residual_scale / std::sqrt(spread) : 0;
}

}  // namespace

double ResponseAt(const ZeroCrossing& fit, double x) {
  return Predict({fit.zero, fit.cut, fit.floor, fit.slope, fit.slope * fit.bend, 0}, x);
}

std::optional<ZeroCrossing> FitZeroCrossing(std::span<const double> x, std::span<const double> y,
                                            std::span<const double> sigma,
                                            const ZeroCrossingOptions& options) {
  TRAMMEL_CHECK(y.size() == x.size() && sigma.size() == x.size(), "x: {}, y: {}, sigma: {} values",
                x.size(), y.size(), sigma.size());
  const std::vector<double> different = SortedDifferent(x);
  if (different.size() < 3) return std::nullopt;
  WeightedFit fit = Iterate(x, y, sigma, different, options);
  ZeroCrossing result;
  result.zero = fit.best.zero;
  result.slope = fit.best.a;
  result.bend = fit.best.a != 0 ? fit.best.b / fit.best.a : 0;
  result.cut = fit.best.cut;
  result.floor = fit.best.floor;
  AddScatter(x, fit, options.scale_floor, result);
  AddUncertainty(x, fit, options, result);
  for (const double at : x) result.fitted.push_back(Predict(fit.best, at));
  result.weight = std::move(fit.robust_weight);
  return result;
}

}  // namespace trammel::signal

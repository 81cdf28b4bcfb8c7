#include "tap/contact/averaging.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace trammel::tap {
namespace {

constexpr std::size_t kMaxOrder = 4;  // HX711 and ADS131 have 4 and 3
constexpr double kMinFall = 8;        // deviations of the noise, from sample to sample
constexpr std::size_t kPasses = 3;    // of averaging and fit, until they agree
// Largest cost of an order above the best one's, in variances of the noise: 95 % quantile of
// chi-squared.
constexpr double kReach = 3.84;
// Penalties in the same unit: of averaging, and of a kink.
constexpr double kAveraging = 1;
constexpr double kKink = 5;

// Weights of a sinc filter at parts of the sampling interval, spaced so that the variance of each
// average is that of a continuous one.
constexpr std::size_t kParts = 4;
constexpr double kPartsPerInterval = 3.872983;  // sqrt(kParts^2 - 1)
constexpr std::size_t TapsOf(std::size_t order) { return order * (kParts - 1) + 1; }
using Weights = std::array<double, TapsOf(kMaxOrder)>;

constexpr Weights WeightsOf(std::size_t order) {
  Weights weights{1};
  for (std::size_t k = 1; k <= order; ++k) {
    Weights next{};
    for (std::size_t i = 0; i < TapsOf(k); ++i) {
      for (std::size_t j = 0; j < kParts && j <= i; ++j) {
        next[i] += weights[i - j] / kParts;
      }
    }
    weights = next;
  }
  return weights;
}

constexpr std::array<Weights, kMaxOrder + 1> kWeights = {WeightsOf(0), WeightsOf(1), WeightsOf(2),
                                                         WeightsOf(3), WeightsOf(4)};

// Returns the most flexible smooth press at the estimate: the rest of averaging must not be taken
// for a kink of the press.
PressShape SmoothShape(const CruiseFit& fit) {
  PressShape shape;
  shape.t = fit.estimate.t;
  shape.c = fit.coefficients.c;
  return shape;
}

// Returns the lowest sum of squares; kinks have a penalty.
double CostOf(const Candidates& candidates, double kink) {
  const auto& model = candidates.model;
  return std::min({model[kQuadratic].sum_squares, model[kCubic].sum_squares,
                   model[kPower].sum_squares, model[kTwoZones].sum_squares + kink});
}

/// Samples of a stretch as averaging of an order would have measured them.
class Averaging {
 public:
  Averaging(const CleanTap& clean, const TapMotion& motion, double latency_s,
            std::span<double> given, PressStretch& stretch)
      : motion_(motion),
        shift_s_(clean.origin_s - latency_s),
        part_s_(clean.period_s / kPartsPerInterval),
        given_(given),
        stretch_(stretch) {
    std::copy(stretch.force.begin(), stretch.force.end(), given.begin());
  }

  // Subtracts the effect of averaging on a press.
  void TakeOut(std::size_t order, const PressShape& shape) {
    for (std::size_t i = 0; i < given_.size(); ++i) {
      stretch_.force[i] = given_[i] - Added(order, shape, i);
    }
  }

 private:
  [[nodiscard]] double Added(std::size_t order, const PressShape& shape, std::size_t i) const {
    const double middle_s = stretch_.time_s[i] + shift_s_;
    const double first_s = middle_s - 0.5 * static_cast<double>(TapsOf(order) - 1) * part_s_;
    double sum = 0;
    for (std::size_t k = 0; k < TapsOf(order); ++k) {
      const double z_mm = motion_.Z(first_s + static_cast<double>(k) * part_s_);
      sum += kWeights[order][k] * shape.At((z_mm - stretch_.z0_mm) / stretch_.span_mm);
    }
    return sum - shape.At(stretch_.y[i]);
  }

  const TapMotion& motion_;
  double shift_s_;
  double part_s_;
  std::span<double> given_;
  PressStretch& stretch_;
};

struct Order {
  PressShape shape;
  double cost = kNever;
  /// Shift of the removed rounding, and so of the next break, per error of the break.
  double follows = 0;
};
using Orders = std::array<Order, kMaxOrder + 1>;

std::size_t Best(const Orders& orders) {
  const auto least = std::min_element(
      orders.begin(), orders.end(), [](const Order& a, const Order& b) { return a.cost < b.cost; });
  return static_cast<std::size_t>(least - orders.begin());
}

// Removes averaging of an order and fits anew until both agree, starting from an attempt.
Order Try(std::size_t number, Averaging& averaging, PressStretch& stretch, CruiseFit& attempt,
          Workspace& workspace) {
  constexpr double kMaxFollowed = 0.5;
  Order order;
  std::array<double, kPasses + 1> t{attempt.estimate.t};
  for (std::size_t pass = 0; pass < kPasses && attempt.Found(); ++pass) {
    order.shape = SmoothShape(attempt);
    averaging.TakeOut(number, order.shape);
    attempt = FitStretch(stretch, {.interval = false}, workspace);
    t[pass + 1] = attempt.estimate.t;
  }
  if (attempt.Found()) {
    const Candidates& candidates = attempt.estimate.candidates;
    const double unit = candidates.noise_variance;
    order.cost = kAveraging * unit + CostOf(candidates, kKink * unit);
    order.follows = t[1] != t[0] ? std::clamp((t[2] - t[1]) / (t[1] - t[0]), 0.0, kMaxFollowed) : 0;
  }
  return order;
}

}  // namespace

AveragedBreaks FitAveraging(const CleanTap& clean, const TapMotion& motion,
                            const TapOptions& options, PressStretch& stretch, CruiseFit& fit,
                            Workspace& workspace) {
  AveragedBreaks breaks;
  const double way = clean.period_s * motion.pull_back_speed_mm_s / stretch.span_mm;
  if (!(fit.estimate.shape.OuterSlope() * way > kMinFall * fit.estimate.noise)) {
    return breaks;
  }
  const Workspace::Scope scope(workspace);
  const std::span<double> given = workspace.Take<double>(stretch.y.size());
  if (given.empty()) {
    return breaks;
  }
  Averaging averaging(clean, motion, options.latency_s, given, stretch);
  Orders orders;
  double unit = fit.estimate.candidates.noise_variance;
  orders[0] = {SmoothShape(fit), CostOf(fit.estimate.candidates, kKink * unit)};
  CruiseFit attempt = fit;
  // Cost without the kink, which may come from averaging of a higher order than the next.
  double smooth = CostOf(fit.estimate.candidates, kNever);
  for (std::size_t order = 1; order <= kMaxOrder && attempt.Found(); ++order) {
    orders[order] = Try(order, averaging, stretch, attempt, workspace);
    const double noise_variance = attempt.estimate.candidates.noise_variance;
    if (Best(orders) == order) {
      unit = noise_variance;
    } else if (orders[order].cost > smooth + kReach * unit) {
      break;
    }
    smooth = std::min(smooth, orders[order].cost);
  }
  const std::size_t best = Best(orders);
  // A toe may look like averaging: with its kink the sharp press remains a candidate without
  // penalty.
  orders[0].cost =
      std::min(orders[0].cost, std::max(orders[best].cost, CostOf(fit.estimate.candidates, 0)));
  for (std::size_t order = 0; order <= kMaxOrder; ++order) {
    const double left = 1 - (orders[order].cost - orders[best].cost) / (kReach * unit);
    if (order == best || !(left > 0)) {
      continue;
    }
    averaging.TakeOut(order, orders[order].shape);
    const BreakEstimate e = FitStretch(stretch, {}, workspace).estimate;
    if (e.outcome == BreakEstimate::Outcome::kFound) {
      // A lower maximum of the likelihood drops out of reach sooner.
      breaks.lo_mm = std::min(breaks.lo_mm, stretch.Z(e.t - std::sqrt(left) * (e.t - e.lo)));
      breaks.hi_mm = std::max(breaks.hi_mm, stretch.Z(e.t + std::sqrt(left) * (e.hi - e.t)));
    }
  }
  averaging.TakeOut(best, orders[best].shape);
  fit = FitStretch(stretch, {}, workspace);
  breaks.widened = 1 / (1 - orders[best].follows);
  return breaks;
}

}  // namespace trammel::tap

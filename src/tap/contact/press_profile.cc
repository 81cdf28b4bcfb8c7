#include "tap/contact/press_profile.h"

#include <algorithm>
#include <limits>

namespace trammel::tap {
namespace {

constexpr double kNoPress = std::numeric_limits<double>::quiet_NaN();  // as a slope

double AtLeast0(double value) { return std::max(0.0, value); }

Pair AtLeast0(const Pair& value) { return value > 0 ? value : Pair{0, 0}; }

}  // namespace

PressProfile::PressProfile(const BreakSamples& samples, Workspace& workspace)
    : samples_(samples), prefix_(workspace.Take<Moments>(samples.y.size() + 1)) {
  if (prefix_.empty()) {
    return;
  }
  // Two powers at a time.
  std::array<Pair, 4> of_y{};
  std::array<Pair, 2> of_force{};
  double force_squares = 0;
  const auto store = [&](Moments& sum) {
    for (std::size_t j = 0; j < sum.y.size(); ++j) {
      sum.y[j] = of_y[j / 2][j % 2];
    }
    for (std::size_t j = 0; j < sum.force.size(); ++j) {
      sum.force[j] = of_force[j / 2][j % 2];
    }
  };
  store(prefix_[0]);
  for (std::size_t i = 0; i < samples.y.size(); ++i) {
    const double y = samples.y[i];
    const double f = samples.force[i];
    const double weight = samples.weight.empty() ? 1 : samples.weight[i];
    force_squares += weight * f * f;
    const double square = y * y;
    Pair power = {weight, weight * y};
#pragma GCC unroll 4
    for (std::size_t j = 0; j < of_y.size(); ++j) {
      of_y[j] += power;
      if (j < of_force.size()) {
        of_force[j] += power * f;
      }
      power *= square;
    }
    store(prefix_[i + 1]);
  }
  force_squares_ = force_squares;
  const Moments& sum = prefix_.back();
  const double length = samples.y.empty() ? 0 : samples.y.back() - samples.y.front();
  count_ = static_cast<double>(samples.y.size());
  samples_per_y_ = length > 0 ? (count_ - 1) / length : 0;
  place_of_0_ = samples.y.empty() ? 0 : 1 - samples.y.front() * samples_per_y_;
  baseline_.inverse_count = sum.y[0] > 0 ? 1 / sum.y[0] : 0;
  baseline_.mean_y = sum.y[1] * baseline_.inverse_count;
  baseline_.mean_force = sum.force[0] * baseline_.inverse_count;
  const double spread = sum.y[2] - sum.y[1] * baseline_.mean_y;
  baseline_.inverse_spread = spread > kLeastPivot * sum.y[2] ? 1 / spread : 0;
  const double together = sum.force[1] - baseline_.mean_y * sum.force[0];
  baseline_.slope = together * baseline_.inverse_spread;
  baseline_.sum_squares =
      force_squares_ - sum.force[0] * baseline_.mean_force - together * baseline_.slope;
}

std::array<double, 6> PressProfile::Totals() const {
  const Moments& all = prefix_.back();
  return {all.y[0], all.y[1], all.y[2], all.force[0], all.force[1], force_squares_};
}

std::size_t PressProfile::BelowNear(double t, std::size_t at) const {
  const std::span<const double> y = samples_.y;
  constexpr int kNear = 12;
  for (int step = 0; step < kNear; ++step) {
    if (at > 0 && !(y[at - 1] < t)) {
      --at;
    } else if (at < y.size() && y[at] < t) {
      ++at;
    } else {
      return at;
    }
  }
  return static_cast<std::size_t>(std::lower_bound(y.begin(), y.end(), t) - y.begin());
}

template <std::size_t kUpTo, class Real>
PressProfile::Elimination<Real> PressProfile::Eliminate(
    const Real& t, const std::array<Real, 2 * kUpTo + 1>& d,
    const std::array<Real, kUpTo + 1>& g) const {
  Elimination<Real> e;
  std::array<Real, kOrders> h{};
  const Real offset = t - baseline_.mean_y;
  for (std::size_t i = 0; i < kUpTo; ++i) {
    e.sum_d[i] = d[i + 1];
    e.sum_dy[i] = offset * d[i + 1] - d[i + 2];
    h[i] = g[i + 1] - baseline_.mean_force * e.sum_d[i] - baseline_.slope * e.sum_dy[i];
  }
  const auto product = [&](std::size_t i, std::size_t j) {
    return d[i + j + 2] - baseline_.inverse_count * e.sum_d[i] * e.sum_d[j] -
           baseline_.inverse_spread * e.sum_dy[i] * e.sum_dy[j];
  };
  const Real i1 = Invert(product(0, 0), d[2]);
  e.solved[0] = h[0] * i1;
  e.gained[0] = h[0] * e.solved[0];
  if constexpr (kUpTo > 1) {
    const Real g12 = product(0, 1);
    e.l12 = g12 * i1;
    const Real h2 = h[1] - e.l12 * h[0];
    const Real i2 = Invert(product(1, 1) - e.l12 * g12, d[4]);
    e.solved[1] = h2 * i2;
    e.gained[1] = h2 * e.solved[1];
    if constexpr (kUpTo > 2) {
      const Real g13 = product(0, 2);
      e.l13 = g13 * i1;
      const Real g23 = product(1, 2) - e.l12 * g13;
      e.l23 = g23 * i2;
      const Real h3 = h[2] - e.l13 * h[0] - e.l23 * h2;
      const Real i3 = Invert(product(2, 2) - e.l13 * g13 - e.l23 * g23, d[6]);
      e.solved[2] = h3 * i3;
      e.gained[2] = h3 * e.solved[2];
    }
  }
  return e;
}

template <std::size_t kUpTo, class Real>
PressProfile::Evaluation<Real> PressProfile::EvaluateSums(
    const Real& t, const std::array<Real, 2 * kUpTo + 1>& d,
    const std::array<Real, kUpTo + 1>& g) const {
  const Elimination<Real> e = Eliminate<kUpTo>(t, d, g);
  Evaluation<Real> at;
  at.sum_squares[0] = AtLeast0(baseline_.sum_squares - e.gained[0]);
  at.start_slope[0] = e.solved[0];
  if constexpr (kUpTo > 1) {
    at.sum_squares[1] = AtLeast0(at.sum_squares[0] - e.gained[1]);
    at.start_slope[1] = e.solved[0] - e.l12 * e.solved[1];
  }
  if constexpr (kUpTo > 2) {
    at.sum_squares[2] = AtLeast0(at.sum_squares[1] - e.gained[2]);
    at.start_slope[2] =
        e.solved[0] - e.l12 * (e.solved[1] - e.l23 * e.solved[2]) - e.l13 * e.solved[2];
  }
  return at;
}

template <std::size_t kUpTo>
PressProfile::At PressProfile::EvaluateOrders(double t, std::size_t below) const {
  const Evaluation<double> sums = EvaluateSums<kUpTo>(
      t, Shifted<2 * kUpTo + 1>(prefix_[below].y, t), Shifted<kUpTo + 1>(prefix_[below].force, t));
  At at{t, {}, {kNoPress, kNoPress, kNoPress}};
  std::copy_n(sums.sum_squares.begin(), kUpTo, at.sum_squares.begin());
  std::copy_n(sums.start_slope.begin(), kUpTo, at.start_slope.begin());
  return at;
}

template <std::size_t kUpTo>
void PressProfile::EvaluatePairs(std::size_t first, std::size_t step, std::span<At> at) const {
  for (std::size_t i = 0; i < at.size(); i += 2) {
    // An odd last one is looked at twice.
    const std::size_t below = first + i * step;
    const std::size_t next = i + 1 < at.size() ? below + step : below;
    const Moments& sums = prefix_[below];
    const Moments& next_sums = prefix_[next];
    const Pair t = {samples_.y[below], samples_.y[next]};
    const Evaluation<Pair> two =
        EvaluateSums<kUpTo>(t, Shifted<2 * kUpTo + 1>(sums.y, next_sums.y, t),
                            Shifted<kUpTo + 1>(sums.force, next_sums.force, t));
    for (std::size_t k = 0; k < 2 && i + k < at.size(); ++k) {
      at[i + k] = {t[k], {}, {kNoPress, kNoPress, kNoPress}};
      for (std::size_t order = 0; order < kUpTo; ++order) {
        at[i + k].sum_squares[order] = two.sum_squares[order][k];
        at[i + k].start_slope[order] = two.start_slope[order][k];
      }
    }
  }
}

PressProfile::At PressProfile::Evaluate(double t, std::size_t below) const {
  return EvaluateOrders<kOrders>(t, below);
}

PressProfile::At PressProfile::EvaluateUpTo(std::size_t orders, double t, std::size_t below) const {
  return orders == 1   ? EvaluateOrders<1>(t, below)
         : orders == 2 ? EvaluateOrders<2>(t, below)
                       : EvaluateOrders<kOrders>(t, below);
}

void PressProfile::EvaluateSamples(std::size_t orders, std::size_t first, std::size_t step,
                                   std::span<At> at) const {
  orders == 1   ? EvaluatePairs<1>(first, step, at)
  : orders == 2 ? EvaluatePairs<2>(first, step, at)
                : EvaluatePairs<kOrders>(first, step, at);
}

PressProfile::Coefficients PressProfile::Fit(double t, std::size_t order) const {
  const Moments& sums = prefix_[Below(t)];
  const Elimination<double> e = Eliminate<kOrders>(t, Shifted<2 * kOrders + 1>(sums.y, t),
                                                   Shifted<kOrders + 1>(sums.force, t));
  Coefficients fit;
  fit.c[2] = order > 2 ? e.solved[2] : 0;
  fit.c[1] = order > 1 ? e.solved[1] - e.l23 * fit.c[2] : 0;
  fit.c[0] = e.solved[0] - e.l12 * fit.c[1] - e.l13 * fit.c[2];
  fit.b = baseline_.slope;
  fit.a = baseline_.mean_force;
  for (std::size_t i = 0; i < kOrders; ++i) {
    fit.a -= baseline_.inverse_count * fit.c[i] * e.sum_d[i];
    fit.b -= baseline_.inverse_spread * fit.c[i] * e.sum_dy[i];
  }
  fit.a += fit.b * (t - baseline_.mean_y);
  return fit;
}

}  // namespace trammel::tap

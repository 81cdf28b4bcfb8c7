#include "tap/contact/press_profile.h"

#include <algorithm>
#include <limits>

namespace trammel::tap {
namespace {

// A pivot below this share of its column is rounding: the column adds nothing.
constexpr double kLeastPivot = 1e-11;
constexpr double kNoPress = std::numeric_limits<double>::quiet_NaN();  // as a slope

// Turns sums of y^j into sums of (at - y)^j over the same samples: differences of neighbours, power
// by power, which is (at - y)^(i+1) y^j = at (at - y)^i y^j - (at - y)^i y^(j+1).
template <class Real, std::size_t kCount>
void Shift(std::array<Real, kCount>& d, const Real& at) {
#pragma GCC unroll 8
  for (std::size_t i = 1; i < kCount; ++i) {
#pragma GCC unroll 8
    for (std::size_t j = kCount - 1; j >= i; --j) {
      d[j] = at * d[j - 1] - d[j];
    }
  }
}

template <std::size_t kCount, std::size_t kAll>
std::array<double, kCount> Shifted(const std::array<double, kAll>& moments, double at) {
  static_assert(kCount <= kAll);
  std::array<double, kCount> d;
  std::copy_n(moments.begin(), kCount, d.begin());
  Shift(d, at);
  return d;
}

template <std::size_t kCount, std::size_t kAll>
std::array<Pair, kCount> Shifted(const std::array<double, kAll>& first,
                                 const std::array<double, kAll>& second, const Pair& at) {
  static_assert(kCount <= kAll);
  std::array<Pair, kCount> d;
#pragma GCC unroll 8
  for (std::size_t i = 0; i < kCount; ++i) {
    d[i] = Pair{first[i], second[i]};
  }
  Shift(d, at);
  return d;
}

double Invert(double pivot, double column) { return pivot > kLeastPivot * column ? 1 / pivot : 0; }

Pair Invert(const Pair& pivot, const Pair& column) {
  return pivot > kLeastPivot * column ? 1 / pivot : Pair{0, 0};
}

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
  samples_per_y_ = length > 0 ? static_cast<double>(samples.y.size() - 1) / length : 0;
  inverse_count_ = sum.y[0] > 0 ? 1 / sum.y[0] : 0;
  mean_y_ = sum.y[1] * inverse_count_;
  mean_force_ = sum.force[0] * inverse_count_;
  const double spread = sum.y[2] - sum.y[1] * mean_y_;
  inverse_spread_ = spread > kLeastPivot * sum.y[2] ? 1 / spread : 0;
  const double together = sum.force[1] - mean_y_ * sum.force[0];
  slope_ = together * inverse_spread_;
  sum_squares_ = force_squares_ - sum.force[0] * mean_force_ - together * slope_;
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
  const Real offset = t - mean_y_;
  for (std::size_t i = 0; i < kUpTo; ++i) {
    e.sum_d[i] = d[i + 1];
    e.sum_dy[i] = offset * d[i + 1] - d[i + 2];
    h[i] = g[i + 1] - mean_force_ * e.sum_d[i] - slope_ * e.sum_dy[i];
  }
  const auto product = [&](std::size_t i, std::size_t j) {
    return d[i + j + 2] - inverse_count_ * e.sum_d[i] * e.sum_d[j] -
           inverse_spread_ * e.sum_dy[i] * e.sum_dy[j];
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
  at.sum_squares[0] = AtLeast0(sum_squares_ - e.gained[0]);
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

PressProfile::OuterZone PressProfile::Outer(double t, std::size_t below) const {
  const auto d = Shifted<3>(prefix_[below].y, t);
  const auto f = Shifted<2>(prefix_[below].force, t);
  OuterZone outer;
  outer.t = t;
  outer.sum = d[1];
  outer.sum_y = (t - mean_y_) * d[1] - d[2];
  outer.force = f[1] - mean_force_ * outer.sum - slope_ * outer.sum_y;
  outer.inverse = Invert(
      d[2] - inverse_count_ * outer.sum * outer.sum - inverse_spread_ * outer.sum_y * outer.sum_y,
      d[2]);
  outer.sum_squares = sum_squares_ - outer.force * outer.force * outer.inverse;
  return outer;
}

[[gnu::always_inline]] inline PressProfile::TwoZones PressProfile::SolveZones(
    const std::array<const OuterZone*, 2>& outer, const InnerZone& inner) const {
  const auto both = [&](double OuterZone::*field) {
    return Pair{outer[0]->*field, outer[1]->*field};
  };
  const Pair outer_sum = both(&OuterZone::sum);
  const Pair outer_sum_y = both(&OuterZone::sum_y);
  const Pair outer_force = both(&OuterZone::force);
  const Pair outer_inverse = both(&OuterZone::inverse);
  const Pair outer_sum_squares = both(&OuterZone::sum_squares);
  // Without the baseline and the outer column.
  const auto& [sum1, sum2] = inner.sum;
  const auto& [sum_y1, sum_y2] = inner.sum_y;
  const Pair g12 = inner.by_outer[0] - inverse_count_ * outer_sum * sum1 -
                   inverse_spread_ * outer_sum_y * sum_y1;
  const Pair g13 = inner.by_outer[1] - inverse_count_ * outer_sum * sum2 -
                   inverse_spread_ * outer_sum_y * sum_y2;
  const Pair l12 = g12 * outer_inverse;
  const Pair l13 = g13 * outer_inverse;
  const Pair g22 =
      inner.p11 - inverse_count_ * sum1 * sum1 - inverse_spread_ * sum_y1 * sum_y1 - l12 * g12;
  const Pair g23 =
      inner.p12 - inverse_count_ * sum1 * sum2 - inverse_spread_ * sum_y1 * sum_y2 - l12 * g13;
  const Pair g33 =
      inner.p22 - inverse_count_ * sum2 * sum2 - inverse_spread_ * sum_y2 * sum_y2 - l13 * g13;
  const Pair i2 = Invert(g22, inner.p11);
  const Pair l23 = g23 * i2;
  const Pair i3 = Invert(g33 - l23 * g23, inner.p22);
  const Pair h2 = inner.force[0] - mean_force_ * sum1 - slope_ * sum_y1 - l12 * outer_force;
  const Pair h3 =
      inner.force[1] - mean_force_ * sum2 - slope_ * sum_y2 - l13 * outer_force - l23 * h2;
  const Pair q = h3 * i3;
  const Pair k = h2 * i2 - l23 * q;
  const Pair c = outer_force * outer_inverse - l12 * k - l13 * q;
  const Pair straight = outer_sum_squares - h2 * h2 * i2;
  return {straight, straight - h3 * q, c, k, q};
}

PressProfile::TwoZones PressProfile::EvaluateTwoZones(const std::array<const OuterZone*, 2>& outer,
                                                      const std::array<double, 2>& at) const {
  const std::array<std::size_t, 2> below = {Below(at[0]), Below(at[1])};
  const Pair s = {at[0], at[1]};
  const auto e = Shifted<5>(prefix_[below[0]].y, prefix_[below[1]].y, s);
  const auto f = Shifted<3>(prefix_[below[0]].force, prefix_[below[1]].force, s);
  const Pair lift = Pair{outer[0]->t, outer[1]->t} - s;
  const Pair y = s - mean_y_;
  return SolveZones(outer, {{e[1], e[2]},
                            {y * e[1] - e[2], y * e[2] - e[3]},
                            {e[2] + lift * e[1], e[3] + lift * e[2]},
                            {f[1], f[2]},
                            e[2],
                            e[3],
                            e[4]});
}

PressProfile::TwoZones PressProfile::EvaluateRounded(const std::array<const OuterZone*, 2>& outer,
                                                     const std::array<double, 2>& from,
                                                     const std::array<double, 2>& to) const {
  const Pair u = {from[0], from[1]};
  const Pair v = {to[0], to[1]};
  const std::array<const Moments*, 2> at_u = {&prefix_[Below(from[0])], &prefix_[Below(from[1])]};
  const std::array<const Moments*, 2> at_v = {&prefix_[Below(to[0])], &prefix_[Below(to[1])]};
  const auto h = Shifted<5>(at_u[0]->y, at_u[1]->y, u);
  const auto e = Shifted<5>(at_v[0]->y, at_v[1]->y, v);
  const auto f_h = Shifted<3>(at_u[0]->force, at_u[1]->force, u);
  const auto f_e = Shifted<3>(at_v[0]->force, at_v[1]->force, v);
  const Pair t = {outer[0]->t, outer[1]->t};
  const Pair length = u - v;
  const Pair half = 0.5 / length;
  const Pair sum_y = (v - mean_y_) * e[2] - e[3];
  const Pair by_outer = e[3] + (t - v) * e[2];
  const Pair squares = h[4] - e[4] - 2 * length * (2 * e[3] + length * e[2]);
  return SolveZones(outer, {{half * (h[2] - e[2]), e[2]},
                            {half * ((u - mean_y_) * h[2] - h[3] - sum_y), sum_y},
                            {half * (h[3] + (t - u) * h[2] - by_outer), by_outer},
                            {half * (f_h[2] - f_e[2]), f_e[2]},
                            half * half * squares,
                            e[3] + 0.5 * length * e[2],
                            e[4]});
}

PressProfile::Coefficients PressProfile::Fit(double t, std::size_t order) const {
  const Moments& sums = prefix_[Below(t)];
  const Elimination<double> e = Eliminate<kOrders>(t, Shifted<2 * kOrders + 1>(sums.y, t),
                                                   Shifted<kOrders + 1>(sums.force, t));
  Coefficients fit;
  fit.c[2] = order > 2 ? e.solved[2] : 0;
  fit.c[1] = order > 1 ? e.solved[1] - e.l23 * fit.c[2] : 0;
  fit.c[0] = e.solved[0] - e.l12 * fit.c[1] - e.l13 * fit.c[2];
  fit.b = slope_;
  fit.a = mean_force_;
  for (std::size_t i = 0; i < kOrders; ++i) {
    fit.a -= inverse_count_ * fit.c[i] * e.sum_d[i];
    fit.b -= inverse_spread_ * fit.c[i] * e.sum_dy[i];
  }
  fit.a += fit.b * (t - mean_y_);
  return fit;
}

}  // namespace trammel::tap

#include "tap/press_profile.h"

#include <algorithm>
#include <type_traits>

namespace trammel::tap {
namespace {

// A pivot below this share of its column is rounding: the column adds nothing.
constexpr double kLeastPivot = 1e-11;

}  // namespace

PressProfile::PressProfile(const BreakSamples& samples, Workspace& workspace)
    : samples_(samples), prefix_(workspace.Take<Moments>(samples.y.size() + 1)) {
  if (prefix_.empty()) {
    return;
  }
  Moments sum{};
  prefix_[0] = sum;
  for (std::size_t i = 0; i < samples.y.size(); ++i) {
    const double y = samples.y[i];
    const double f = samples.force[i];
    double power = samples.weight.empty() ? 1 : samples.weight[i];
    force_squares_ += power * f * f;
    for (std::size_t j = 0; j < sum.y.size(); ++j) {
      sum.y[j] += power;
      if (j < sum.force.size()) {
        sum.force[j] += power * f;
      }
      power *= y;
    }
    prefix_[i + 1] = sum;
  }
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

std::size_t PressProfile::Below(double t) const {
  return static_cast<std::size_t>(std::lower_bound(samples_.y.begin(), samples_.y.end(), t) -
                                  samples_.y.begin());
}

PressProfile::Elimination PressProfile::Eliminate(double t, std::size_t below) const {
  // Sums of (t - y)^i over the press: differences of neighbours, power by power, which is
  // (t - y)^(i+1) y^j = t (t - y)^i y^j - (t - y)^i y^(j+1).
  std::array<double, 7> d = prefix_[below].y;
#pragma GCC unroll 8
  for (std::size_t i = 1; i < d.size(); ++i) {
#pragma GCC unroll 8
    for (std::size_t j = d.size() - 1; j >= i; --j) {
      d[j] = t * d[j - 1] - d[j];
    }
  }
  std::array<double, 4> g = prefix_[below].force;
#pragma GCC unroll 4
  for (std::size_t i = 1; i < g.size(); ++i) {
#pragma GCC unroll 4
    for (std::size_t j = g.size() - 1; j >= i; --j) {
      g[j] = t * g[j - 1] - g[j];
    }
  }
  Elimination e;
  std::array<double, kOrders> h{};
  const double offset = t - mean_y_;
  for (std::size_t i = 0; i < kOrders; ++i) {
    e.sum_d[i] = d[i + 1];
    e.sum_dy[i] = offset * d[i + 1] - d[i + 2];
    h[i] = g[i + 1] - mean_force_ * e.sum_d[i] - slope_ * e.sum_dy[i];
  }
  const auto product = [&](std::size_t i, std::size_t j) {
    return d[i + j + 2] - inverse_count_ * e.sum_d[i] * e.sum_d[j] -
           inverse_spread_ * e.sum_dy[i] * e.sum_dy[j];
  };
  const auto invert = [](double pivot, double column) {
    return pivot > kLeastPivot * column ? 1 / pivot : 0;
  };
  const double g12 = product(0, 1);
  const double g13 = product(0, 2);
  const double i1 = invert(product(0, 0), d[2]);
  e.l12 = g12 * i1;
  e.l13 = g13 * i1;
  const double g23 = product(1, 2) - e.l12 * g13;
  const double h2 = h[1] - e.l12 * h[0];
  const double i2 = invert(product(1, 1) - e.l12 * g12, d[4]);
  e.l23 = g23 * i2;
  const double h3 = h[2] - e.l13 * h[0] - e.l23 * h2;
  const double i3 = invert(product(2, 2) - e.l13 * g13 - e.l23 * g23, d[6]);
  e.solved = {h[0] * i1, h2 * i2, h3 * i3};
  e.gained = {h[0] * e.solved[0], h2 * e.solved[1], h3 * e.solved[2]};
  return e;
}

PressProfile::At PressProfile::Evaluate(double t, std::size_t below) const {
  const Elimination e = Eliminate(t, below);
  At at{};
  at.t = t;
  at.sum_squares[0] = std::max(0.0, sum_squares_ - e.gained[0]);
  at.sum_squares[1] = std::max(0.0, at.sum_squares[0] - e.gained[1]);
  at.sum_squares[2] = std::max(0.0, at.sum_squares[1] - e.gained[2]);
  at.start_slope[0] = e.solved[0];
  at.start_slope[1] = e.solved[0] - e.l12 * e.solved[1];
  at.start_slope[2] =
      e.solved[0] - e.l12 * (e.solved[1] - e.l23 * e.solved[2]) - e.l13 * e.solved[2];
  return at;
}

PressProfile::Kinked PressProfile::EvaluateKinked(double t, std::size_t below_t, double s,
                                                  std::size_t below_s) const {
  struct Hinge {
    double d;   // sum of max(0, t - y)
    double dy;  // times y - mean
    double h;   // times the force about the baseline
  };
  const auto hinge = [this](double at, const Moments& m) {
    Hinge sums{};
    sums.d = at * m.y[0] - m.y[1];
    sums.dy = at * m.y[1] - m.y[2] - mean_y_ * sums.d;
    sums.h = at * m.force[0] - m.force[1] - mean_force_ * sums.d - slope_ * sums.dy;
    return sums;
  };
  const auto product = [this](const Moments& m, double at, double other, const Hinge& a,
                              const Hinge& b) {
    return at * other * m.y[0] - (at + other) * m.y[1] + m.y[2] - inverse_count_ * a.d * b.d -
           inverse_spread_ * a.dy * b.dy;
  };
  const Moments& outer_sums = prefix_[below_t];
  const Moments& inner_sums = prefix_[below_s];
  const Hinge outer = hinge(t, outer_sums);
  const Hinge inner = hinge(s, inner_sums);
  const double g11 = product(outer_sums, t, t, outer, outer);
  const double g12 = product(inner_sums, t, s, outer, inner);
  const double g22 = product(inner_sums, s, s, inner, inner);
  const double determinant = g11 * g22 - g12 * g12;
  if (!(determinant > kLeastPivot * g11 * g22)) {
    return {sum_squares_, 0, 0};
  }
  const double c = (outer.h * g22 - inner.h * g12) / determinant;
  const double k = (inner.h * g11 - outer.h * g12) / determinant;
  return {std::max(0.0, sum_squares_ - c * outer.h - k * inner.h), c, k};
}

PressProfile::TwoZones PressProfile::EvaluateTwoZones(double t, std::size_t below_t, double s,
                                                      std::size_t below_s) const {
  // Sums over y < at of (at - y)^i, and of the force times them.
  const auto shifted = [](const auto& moments, double at) {
    auto d = moments;
#pragma GCC unroll 8
    for (std::size_t i = 1; i < d.size(); ++i) {
#pragma GCC unroll 8
      for (std::size_t j = d.size() - 1; j >= i; --j) {
        d[j] = at * d[j - 1] - d[j];
      }
    }
    return d;
  };
  const auto first = [](const auto& all, auto count) {
    std::array<double, decltype(count)::value> some;
    std::copy_n(all.begin(), some.size(), some.begin());
    return some;
  };
  const Moments& at_t = prefix_[below_t];
  const Moments& at_s = prefix_[below_s];
  const auto outer = shifted(first(at_t.y, std::integral_constant<std::size_t, 3>{}), t);
  const auto outer_f = shifted(first(at_t.force, std::integral_constant<std::size_t, 2>{}), t);
  const auto inner = shifted(first(at_s.y, std::integral_constant<std::size_t, 5>{}), s);
  const auto inner_f = shifted(first(at_s.force, std::integral_constant<std::size_t, 3>{}), s);
  // Each column: its sum, its sum times y - mean, its product with the force about the baseline.
  const std::array<double, 3> d = {outer[1], inner[1], inner[2]};
  const std::array<double, 3> dy = {(t - mean_y_) * outer[1] - outer[2],
                                    (s - mean_y_) * inner[1] - inner[2],
                                    (s - mean_y_) * inner[2] - inner[3]};
  const std::array<double, 3> f = {outer_f[1], inner_f[1], inner_f[2]};
  std::array<double, 3> h{};
  for (std::size_t i = 0; i < 3; ++i) {
    h[i] = f[i] - mean_force_ * d[i] - slope_ * dy[i];
  }
  const auto less = [&](double product, std::size_t i, std::size_t j) {
    return product - inverse_count_ * d[i] * d[j] - inverse_spread_ * dy[i] * dy[j];
  };
  const double lift = t - s;
  const auto invert = [](double pivot, double column) {
    return pivot > kLeastPivot * column ? 1 / pivot : 0;
  };
  const double i1 = invert(less(outer[2], 0, 0), outer[2]);
  const double g12 = less(inner[2] + lift * inner[1], 0, 1);
  const double g13 = less(inner[3] + lift * inner[2], 0, 2);
  const double l12 = g12 * i1;
  const double l13 = g13 * i1;
  const double i2 = invert(less(inner[2], 1, 1) - l12 * g12, inner[2]);
  const double g23 = less(inner[3], 1, 2) - l12 * g13;
  const double l23 = g23 * i2;
  const double i3 = invert(less(inner[4], 2, 2) - l13 * g13 - l23 * g23, inner[4]);
  const double h2 = h[1] - l12 * h[0];
  const double h3 = h[2] - l13 * h[0] - l23 * h2;
  const double q = h3 * i3;
  const double k = h2 * i2 - l23 * q;
  const double c = h[0] * i1 - l12 * k - l13 * q;
  const double straight = sum_squares_ - h[0] * h[0] * i1 - h2 * h2 * i2;
  return {std::max(0.0, straight), std::max(0.0, straight - h3 * q), c, k, q};
}

PressProfile::Coefficients PressProfile::Fit(double t, std::size_t order) const {
  const Elimination e = Eliminate(t, Below(t));
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

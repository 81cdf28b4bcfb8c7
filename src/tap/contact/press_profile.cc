#include "tap/contact/press_profile.h"

#include <algorithm>

namespace trammel::tap {

PressProfile::PressProfile(const BreakSamples& samples, Workspace& workspace)
    : samples_(samples), prefix_(workspace.Take<Moments>(samples.y.size() + 1)) {
  if (prefix_.empty()) {
    return;
  }
  Moments running{};
  double force_squares = 0;
  prefix_[0] = running;
  for (std::size_t i = 0; i < samples.y.size(); ++i) {
    const double y = samples.y[i];
    const double f = samples.force[i];
    const double weight = samples.weight.empty() ? 1 : samples.weight[i];
    force_squares += weight * f * f;
    double even = weight;
    double odd = weight * y;
    for (std::size_t j = 0; j < running.y.size(); j += 2) {
      running.y[j] += even;
      if (j + 1 < running.y.size()) running.y[j + 1] += odd;
      if (j < running.force.size()) {
        running.force[j] += even * f;
        running.force[j + 1] += odd * f;
      }
      even *= y * y;
      odd *= y * y;
    }
    prefix_[i + 1] = running;
  }
  force_squares_ = force_squares;
  const Moments& sum = prefix_.back();
  baseline_.inverse_count = sum.y[0] > 0 ? 1 / sum.y[0] : 0;
  baseline_.mean_y = sum.y[1] * baseline_.inverse_count;
  baseline_.mean_force = sum.force[0] * baseline_.inverse_count;
  const double spread = sum.y[2] - sum.y[1] * baseline_.mean_y;
  baseline_.inverse_spread = spread > kMinPivot * sum.y[2] ? 1 / spread : 0;
  const double together = sum.force[1] - baseline_.mean_y * sum.force[0];
  baseline_.slope = together * baseline_.inverse_spread;
  baseline_.sum_squares =
      force_squares_ - sum.force[0] * baseline_.mean_force - together * baseline_.slope;
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
  // Sums over the samples below t, of (t - y)^i and of these times the force.
  const auto d = Shifted<2 * kOrders + 1>(prefix_[below].y, t);
  const auto g = Shifted<kOrders + 1>(prefix_[below].force, t);
  Elimination e;
  std::array<double, kOrders> h{};
  const double offset = t - baseline_.mean_y;
  for (std::size_t i = 0; i < kOrders; ++i) {
    e.sum_d[i] = d[i + 1];
    e.sum_dy[i] = offset * d[i + 1] - d[i + 2];
    h[i] = g[i + 1] - baseline_.mean_force * e.sum_d[i] - baseline_.slope * e.sum_dy[i];
  }
  const auto product = [&](std::size_t i, std::size_t j) {
    return d[i + j + 2] - baseline_.inverse_count * e.sum_d[i] * e.sum_d[j] -
           baseline_.inverse_spread * e.sum_dy[i] * e.sum_dy[j];
  };
  const double i1 = Invert(product(0, 0), d[2]);
  const double g12 = product(0, 1);
  e.l12 = g12 * i1;
  const double h2 = h[1] - e.l12 * h[0];
  const double i2 = Invert(product(1, 1) - e.l12 * g12, d[4]);
  const double g13 = product(0, 2);
  e.l13 = g13 * i1;
  const double g23 = product(1, 2) - e.l12 * g13;
  e.l23 = g23 * i2;
  const double h3 = h[2] - e.l13 * h[0] - e.l23 * h2;
  const double i3 = Invert(product(2, 2) - e.l13 * g13 - e.l23 * g23, d[6]);
  e.solved = {h[0] * i1, h2 * i2, h3 * i3};
  e.gained = {h[0] * e.solved[0], h2 * e.solved[1], h3 * e.solved[2]};
  return e;
}

PressProfile::At PressProfile::Evaluate(double t, std::size_t below) const {
  const Elimination e = Eliminate(t, below);
  At at{t, {}, {}};
  double rest = baseline_.sum_squares;
  for (std::size_t i = 0; i < kOrders; ++i) {
    rest = std::max(0.0, rest - e.gained[i]);
    at.sum_squares[i] = rest;
  }
  at.start_slope = {
      e.solved[0], e.solved[0] - e.l12 * e.solved[1],
      e.solved[0] - e.l12 * (e.solved[1] - e.l23 * e.solved[2]) - e.l13 * e.solved[2]};
  return at;
}

PressProfile::Coefficients PressProfile::Fit(double t, std::size_t order) const {
  const Elimination e = Eliminate(t, Below(t));
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

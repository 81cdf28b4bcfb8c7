#include "tap/press_profile.h"

#include <algorithm>

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
  Moments sum;
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
}

std::array<double, 6> PressProfile::Totals() const {
  const Moments& all = prefix_.back();
  return {all.y[0], all.y[1], all.y[2], all.force[0], all.force[1], force_squares_};
}

std::size_t PressProfile::Below(double t) const {
  return static_cast<std::size_t>(std::lower_bound(samples_.y.begin(), samples_.y.end(), t) -
                                  samples_.y.begin());
}

void PressProfile::Eliminate(double t, std::size_t below, Matrix& u) const {
  const Moments& all = prefix_.back();
  const Moments& in = prefix_[below];
  // Sums of (t - y)^i over the press: differences of neighbours, power by power, which is
  // (t - y)^(i+1) y^j = t (t - y)^i y^j - (t - y)^i y^(j+1).
  std::array<double, 7> d{};
  std::array<double, 7> work = in.y;
  for (std::size_t i = 0; i < d.size(); ++i) {
    d[i] = work[0];
    for (std::size_t j = 0; j + 1 < d.size() - i; ++j) {
      work[j] = t * work[j] - work[j + 1];
    }
  }
  std::array<double, 4> g{};
  std::array<double, 4> force = in.force;
  for (std::size_t i = 0; i < g.size(); ++i) {
    g[i] = force[0];
    for (std::size_t j = 0; j + 1 < g.size() - i; ++j) {
      force[j] = t * force[j] - force[j + 1];
    }
  }
  u[0] = {all.y[0], all.y[1] - t * all.y[0], d[1], d[2], d[3], all.force[0]};
  u[1] = {0,     all.y[2] - 2 * t * all.y[1] + t * t * all.y[0],
          -d[2], -d[3],
          -d[4], all.force[1] - t * all.force[0]};
  u[2] = {0, 0, d[2], d[3], d[4], g[1]};
  u[3] = {0, 0, 0, d[4], d[5], g[2]};
  u[4] = {0, 0, 0, 0, d[6], g[3]};
  u[5] = {0, 0, 0, 0, 0, force_squares_};
  for (std::size_t k = 0; k + 1 < kColumns; ++k) {
    const double least = kLeastPivot * (k < 2 ? u[k][k] : d[2 * (k - 1)]);
    const double inverse = u[k][k] > least ? 1 / u[k][k] : 0;
    for (std::size_t i = k + 1; i < kColumns; ++i) {
      const double factor = u[k][i] * inverse;
      for (std::size_t j = i; j < kColumns; ++j) {
        u[i][j] -= factor * u[k][j];
      }
    }
    for (std::size_t j = k + 1; j < kColumns; ++j) {
      u[k][j] *= inverse;
    }
  }
}

PressProfile::At PressProfile::Evaluate(double t, std::size_t below) const {
  Matrix u;
  Eliminate(t, below, u);
  // The elimination has scaled each row by its pivot; what order k leaves of the sum of squares is
  // the last diagonal entry with the later columns' shares put back.
  At at;
  at.t = t;
  at.sum_squares[2] = std::max(0.0, u[5][5]);
  at.sum_squares[1] = at.sum_squares[2] + u[4][4] * u[4][5] * u[4][5];
  at.sum_squares[0] = at.sum_squares[1] + u[3][3] * u[3][5] * u[3][5];
  at.start_slope[0] = u[2][5];
  at.start_slope[1] = u[2][5] - u[2][3] * u[3][5];
  const double c2 = u[3][5] - u[3][4] * u[4][5];
  at.start_slope[2] = u[2][5] - u[2][3] * c2 - u[2][4] * u[4][5];
  return at;
}

PressProfile::Coefficients PressProfile::Fit(double t, std::size_t order) const {
  Matrix u;
  Eliminate(t, Below(t), u);
  std::array<double, kColumns> x{};
  for (std::size_t k = 2 + order; k-- > 0;) {
    x[k] = u[k][kColumns - 1];
    for (std::size_t j = k + 1; j < 2 + order; ++j) {
      x[k] -= u[k][j] * x[j];
    }
  }
  return {x[0], x[1], {x[2], x[3], x[4]}};
}

}  // namespace trammel::tap

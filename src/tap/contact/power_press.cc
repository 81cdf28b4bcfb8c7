#include "tap/contact/power_press.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "tap/contact/float_lanes.h"

namespace trammel::tap {
namespace {

constexpr int kMostPasses = 20;
constexpr double kLeastPower = 0.5;
constexpr double kMostPower = 2.5;
constexpr double kStraight = 0.02;  // nearer to 1 the straight press says the same
constexpr double kEnough = 0.02;    // of the break's standard deviation, the last step

// Columns: 1, y, d^p, derivative by t / c, derivative by p / c; the force last.
constexpr std::size_t kColumns = 6;
using Matrix = std::array<std::array<double, kColumns>, kColumns>;

// Depths below a break with their logarithms and powers, four at a time.
struct Powers {
  static constexpr std::size_t kGroups = 8;
  std::array<Floats, kGroups> logs;
  std::array<Floats, kGroups> powers;

  // Single precision, in which a processor works out four: 1e-7 of the press is far below any
  // noise. By themselves, because each of these waits for many steps one after the other, and a
  // processor begins with the next ones meanwhile only if they are near.
  void Take(std::span<const double> y, std::size_t first, double t, double p) {
    for (std::size_t g = 0; g < kGroups && first + g * kLanes < y.size(); ++g) {
      Floats depth;
      for (std::size_t k = 0; k < kLanes; ++k) {
        depth[k] = static_cast<float>(t - y[std::min(first + g * kLanes + k, y.size() - 1)]);
      }
      logs[g] = Log(depth);
      powers[g] = Exp(static_cast<float>(p) * logs[g]);
    }
  }
};

void Sum(const PressProfile& profile, double t, double p, Matrix& m) {
  const BreakSamples& samples = profile.samples();
  const std::array<double, 6> all = profile.Totals();
  std::array<Pair, 15> sums{};
  const std::size_t below = profile.Below(t);
  Powers at_once;
  for (std::size_t i = 0; i < below; i += kLanes) {
    const std::size_t group = i / kLanes % Powers::kGroups;
    if (group == 0) {
      at_once.Take(samples.y.first(below), i, t, p);
    }
    // Where the last ones are missing, the very last is looked at again, and counts once.
    const auto at = [&](std::size_t k) { return std::min(i + k, below - 1); };
    const Floats& logs = at_once.logs[group];
    const Floats& powers = at_once.powers[group];
    for (std::size_t k = 0; k < kLanes; k += 2) {
      const Pair y = {samples.y[at(k)], samples.y[at(k + 1)]};
      const Pair f = {samples.force[at(k)], samples.force[at(k + 1)]};
      Pair w = {i + k < below ? 1.0 : 0.0, i + k + 1 < below ? 1.0 : 0.0};
      if (!samples.weight.empty()) {
        w *= Pair{samples.weight[at(k)], samples.weight[at(k + 1)]};
      }
      const Pair d = t - y;
      const Pair log_d = {logs[k], logs[k + 1]};
      const Pair power = {powers[k], powers[k + 1]};
      const Pair by_t = p * power / d;
      const Pair by_p = power * log_d;
      const Pair wa = w * power;
      const Pair wt = w * by_t;
      const Pair wp = w * by_p;
      sums[0] += wa;
      sums[1] += wt;
      sums[2] += wp;
      sums[3] += wa * y;
      sums[4] += wt * y;
      sums[5] += wp * y;
      sums[6] += wa * power;
      sums[7] += wa * by_t;
      sums[8] += wa * by_p;
      sums[9] += wt * by_t;
      sums[10] += wt * by_p;
      sums[11] += wp * by_p;
      sums[12] += wa * f;
      sums[13] += wt * f;
      sums[14] += wp * f;
    }
  }
  std::array<double, sums.size()> s;
  std::transform(sums.begin(), sums.end(), s.begin(),
                 [](const Pair& two) { return two[0] + two[1]; });
  m[0] = {all[0], all[1], s[0], s[1], s[2], all[3]};
  m[1] = {0, all[2], s[3], s[4], s[5], all[4]};
  m[2] = {0, 0, s[6], s[7], s[8], s[12]};
  m[3] = {0, 0, 0, s[9], s[10], s[13]};
  m[4] = {0, 0, 0, 0, s[11], s[14]};
  m[5] = {0, 0, 0, 0, 0, all[5]};
}

// Rows end up divided by their pivots, which stay on the diagonal.
bool Eliminate(Matrix& m) {
  for (std::size_t k = 0; k + 1 < kColumns; ++k) {
    if (!(m[k][k] > 0)) {
      return false;
    }
    const double inverse = 1 / m[k][k];
    for (std::size_t i = k + 1; i < kColumns; ++i) {
      const double factor = m[k][i] * inverse;
      for (std::size_t j = i; j < kColumns; ++j) {
        m[i][j] -= factor * m[k][j];
      }
    }
    for (std::size_t j = k + 1; j < kColumns; ++j) {
      m[k][j] *= inverse;
    }
  }
  return true;
}

}  // namespace

PowerPress FitPowerPress(const PressProfile& profile, double start_t) {
  const PressProfile::Coefficients quadratic = profile.Fit(start_t, 2);
  const double depth = start_t;  // of the first sample, where y is 0
  const double linear_g = quadratic.c[0];
  const double curved_g = quadratic.c[1] * depth;
  PowerPress press;
  if (!(linear_g + curved_g > 0)) {
    return press;
  }
  // The exponent with the same slope at the deepest sample for its force.
  double t = start_t;
  double p = std::clamp((linear_g + 2 * curved_g) / (linear_g + curved_g), 0.6, 1.9);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    Matrix m;
    Sum(profile, t, p, m);
    if (!Eliminate(m)) {
      return press;
    }
    // The part of the sum of squares that the two derivatives cannot explain away is what the
    // linear parameters leave at this t and p.
    const double by_p = m[4][5];
    const double by_t = m[3][5] - m[3][4] * by_p;
    const double c_here = m[2][5];  // at this t and p, without the derivatives
    const double c = m[2][5] - m[2][3] * by_t - m[2][4] * by_p;
    const double scale = c_here > 0 ? c_here : c;
    if (!(scale > 0)) {
      return press;
    }
    press.sum_squares = m[5][5] + m[4][4] * m[4][5] * m[4][5] + m[3][3] * m[3][5] * m[3][5];
    press.t = t;
    press.p = p;
    press.c = c_here;
    press.b = m[1][5] - m[1][2] * c_here;
    press.a = m[0][5] - m[0][1] * press.b - m[0][2] * c_here;
    // Variance of the fourth of five columns: pivots 3 and 4.
    press.standard_deviation = std::sqrt(1 / m[3][3] + m[3][4] * m[3][4] / m[4][4]) / scale;
    const double step_t = std::clamp(by_t / scale, -0.1 * depth, 0.1 * depth);
    const double step_p = std::clamp(by_p / scale, -0.25, 0.25);
    if (std::abs(by_t / scale) < kEnough * press.standard_deviation || pass + 1 == kMostPasses) {
      press.found = p > kLeastPower && p < kMostPower && std::abs(p - 1) > kStraight;
      return press;
    }
    t += step_t;
    p += step_p;
    if (p <= kLeastPower || p > kMostPower || !(t > 0.02) || !(t < 1)) {
      return press;
    }
  }
  return press;
}

}  // namespace trammel::tap

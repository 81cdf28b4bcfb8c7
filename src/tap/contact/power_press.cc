#include "tap/contact/power_press.h"

#include <algorithm>
#include <cmath>

#include "tap/contact/normal_equations.h"

namespace trammel::tap {
namespace {

constexpr int kMaxPasses = 20;
constexpr double kMinPower = 0.5;
constexpr double kMaxPower = 2.5;
constexpr double kStraight = 0.02;  // nearer to 1 the straight press says the same
constexpr double kEnough = 0.02;    // last step over the break's standard deviation

// Columns: 1, y, d^p, derivative by t / c, derivative by p / c; the force last.
Normal NormalEquations(const BreakSamples& samples, double t, double p) {
  Normal m{};
  for (std::size_t i = 0; i < samples.y.size(); ++i) {
    NormalRow columns = {1, samples.y[i], 0, 0, 0, samples.force[i]};
    if (const double d = t - samples.y[i]; d > 0) {
      const double log_d = std::log(d);
      const double power = std::exp(p * log_d);
      columns[2] = power;
      columns[3] = p * power / d;
      columns[4] = power * log_d;
    }
    AddRow(columns, samples.weight.empty() ? 1 : samples.weight[i], m);
  }
  return m;
}

}  // namespace

PowerPress FitPowerPress(const PressProfile& profile, double start_t) {
  const PressProfile::Coefficients quadratic = profile.Fit(start_t, 2);
  const double depth = start_t;  // depth of the first sample, where y is 0
  const double linear_g = quadratic.c[0];
  const double curved_g = quadratic.c[1] * depth;
  PowerPress press;
  if (!(linear_g + curved_g > 0)) {
    return press;
  }
  // Exponent with the same slope at the deepest sample for its force.
  double t = start_t;
  double p = std::clamp((linear_g + 2 * curved_g) / (linear_g + curved_g), 0.6, 1.9);
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    Normal m = NormalEquations(profile.samples(), t, p);
    if (!Eliminate(m)) {
      return press;
    }
    // The linear parameters' residual at this t and p is the part of the sum of squares that the
    // two derivatives do not explain.
    const double by_p = m[4][5];
    const double by_t = m[3][5] - m[3][4] * by_p;
    const double c_here = m[2][5];  // at this t and p, excluding the derivatives
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
    if (std::abs(by_t / scale) < kEnough * press.standard_deviation || pass + 1 == kMaxPasses) {
      press.found = p > kMinPower && p < kMaxPower && std::abs(p - 1) > kStraight;
      return press;
    }
    t += step_t;
    p += step_p;
    if (p <= kMinPower || p > kMaxPower || !(t > 0.02) || !(t < 1)) {
      return press;
    }
  }
  return press;
}

}  // namespace trammel::tap

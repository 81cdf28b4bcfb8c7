#include "tap/contact/latency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tap/contact/normal_equations.h"
#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

constexpr double kMaxPeriods = 2;  // in samples: delay of a converter's filter
constexpr double kTransport_s = 0.005;
constexpr double kOffset_mm = 0.006;
constexpr double kScale = 0.1;
// Backlash and bending that differ between the two ways in other forms than these, at both speeds:
// 1.5 um for drives whose offset is the prior's, and proportionally less where the approach shows
// less.
constexpr double kBacklash_mm = 0.0015;
constexpr double kRest_mm = 0.002;     // for a press that is flat at its deepest end
constexpr std::size_t kMinBefore = 8;  // samples before the touch, for the base
constexpr double kRest_s = 0.02;       // start of the halt, before creep matters
constexpr std::size_t kMinRest = 4;
constexpr std::size_t kMaxInRange = 96;
constexpr int kMaxSteps = 8;

// The unknowns are base, scale, latency, offset, force at rest.
constexpr std::size_t kUnknowns = kNormalUnknowns;

struct State {
  double scale = 1;
  double latency_s = 0;
  double offset_mm = 0;
  double rest_g = 0;
};

// Returns the stretch from before the earliest touch to some samples after the halt.
Stretch Approach(const CleanTap& clean, const TapMotion& motion, const SeenPress& press,
                 double max_s) {
  const auto& times = clean.samples.time_s;
  const double break_mm = press.z0_mm + press.shape.t * press.span_mm;
  const double depth_s = std::max(0.0, break_mm - motion.halt_z_mm) / motion.approach_speed_mm_s;
  const double halt_s = motion.approach_end_s - clean.origin_s;
  const std::size_t touch = IndexAt(times, halt_s - 1.5 * depth_s);
  const double rest_s = std::max(kRest_s, kMinRest * clean.period_s);
  Stretch range;
  const auto before =
      std::max(kMinBefore, static_cast<std::size_t>(0.5 * depth_s / clean.period_s));
  range.first = touch - std::min(touch, before);
  range.end = IndexAt(times, std::min(halt_s + max_s + rest_s, 0.0));
  range.end = std::min(range.end, range.first + kMaxInRange);
  return range;
}

// Estimates the drive's backlash at rest, mm: the height, above the halt, at which the press has
// the force of rest. The head rises by as much before the force falls.
double BacklashAtRest(const CleanTap& clean, const TapMotion& motion, const SeenPress& press) {
  constexpr int kHeights = 64;
  const double halt_y = (motion.halt_z_mm - press.z0_mm) / press.span_mm;
  const double step = (press.shape.t - halt_y) / kHeights;
  // A drift acts as long before the rest as after it. The noise of a sample is subtracted:
  // otherwise a press that is flat at its deepest end never reaches it.
  const double free_g = 0.5 * (clean.approach_g + clean.departure_g);
  const double rest_g = press.sign * (clean.dwell_g - free_g) - press.noise_g;
  if (!(step > 0) || !(rest_g > 0)) {
    return 0;
  }
  int i = kHeights;
  while (i > 0 && !(press.shape.At(halt_y + i * step) >= rest_g)) {
    --i;
  }
  return i * step * press.span_mm;
}

class Fit {
 public:
  Fit(const CleanTap& clean, const TapMotion& motion, const SeenPress& press, const Stretch& range,
      double prior_s, double backlash_mm)
      : clean_(clean),
        motion_(motion),
        press_(press),
        range_(range),
        prior_s_(prior_s),
        backlash_mm_(backlash_mm) {}

  // Computes the normal equations at a state, in units of the variance, priors included.
  [[nodiscard]] Normal Sum(const State& state, double variance) const {
    Normal m{};
    const double first_g = clean_.samples.force_g[range_.first];
    for (std::size_t i = range_.first; i < range_.end; ++i) {
      const double y = Y(i, state);
      const double g = press_.sign * (clean_.samples.force_g[i] - first_g);
      const bool rests = y < press_.shape.t && !(Time(i, state) < motion_.approach_end_s);
      AddRow(RowOf(y, rests, g, state), 1, m);
    }
    const double weight = 1 / variance;
    for (auto& row : m) {
      for (double& value : row) {
        value *= weight;
      }
    }
    const auto prior = [&m](std::size_t k, double off, double deviation) {
      m[k][k] += 1 / (deviation * deviation);
      m[k][kUnknowns] += off / (deviation * deviation);
      m[kUnknowns][kUnknowns] += off * off / (deviation * deviation);
    };
    prior(1, 1 - state.scale, kScale);
    prior(2, prior_s_ - state.latency_s, prior_s_);
    prior(3, backlash_mm_ - state.offset_mm, kOffset_mm);
    prior(4, -state.rest_g, RestDeviation());
    return m;
  }

  // Returns the variance factor of correlated residuals, as of a first-order regression (Bartlett
  // 1946).
  [[nodiscard]] double Inflation(const State& state) const {
    constexpr double kMax = 0.9;
    std::array<double, kMaxInRange> left;
    const std::size_t n = range_.size();
    double base = 0;
    for (std::size_t i = 0; i < n; ++i) {
      left[i] = Left(range_.first + i, state);
      base += left[i] / static_cast<double>(n);
    }
    double squares = 0;
    double products = 0;
    for (std::size_t i = 0; i < n; ++i) {
      squares += (left[i] - base) * (left[i] - base);
      products += i > 0 ? (left[i] - base) * (left[i - 1] - base) : 0;
    }
    const double r = squares > 0 ? std::clamp(products / squares, 0.0, kMax) : 0;
    return (1 + r) / (1 - r);
  }

 private:
  // Computes derivatives and residual of a pressed sample's force.
  [[nodiscard]] NormalRow RowOf(double y, bool rests, double g, const State& state) const {
    const double p = press_.shape.At(y);
    const double by_offset = state.scale * press_.shape.Slope(y) / press_.span_mm;
    const double speed = rests ? 0 : motion_.approach_speed_mm_s;
    return {1,
            p,
            by_offset * (speed + motion_.pull_back_speed_mm_s),
            by_offset,
            rests ? 1.0 : 0.0,
            g - state.scale * p - (rests ? state.rest_g : 0)};
  }
  [[nodiscard]] double Left(std::size_t i, const State& state) const {
    const bool rests = !(Time(i, state) < motion_.approach_end_s);
    return press_.sign * clean_.samples.force_g[i] - state.scale * press_.shape.At(Y(i, state)) -
           (rests ? state.rest_g : 0);
  }
  // Returns the deviation of the force at rest. A press that is flat at its deepest end, beyond the
  // softening of a sound one, may be a drive that lags: at rest, on the other side of its backlash,
  // the force is then less certain.
  [[nodiscard]] double RestDeviation() const {
    constexpr double kSoft = 0.4;   // relative to the slope at the break
    constexpr double kMin = 0.001;  // keeps the prior finite
    const double outer = press_.shape.OuterSlope();
    const double flat = std::min(1.0, 1 + press_.shape.Slope(0) / (kSoft * outer));
    return kRest_mm * std::max(kMin, flat) * outer / press_.span_mm;
  }
  [[nodiscard]] double Time(std::size_t i, const State& state) const {
    return clean_.origin_s + clean_.samples.time_s[i] - state.latency_s;
  }
  // Returns the head's height when the force acted, in units of the pull-back's stretch.
  [[nodiscard]] double Y(std::size_t i, const State& state) const {
    const double z_mm = motion_.Z(Time(i, state)) + state.offset_mm +
                        motion_.pull_back_speed_mm_s * (state.latency_s - press_.latency_s);
    return (z_mm - press_.z0_mm) / press_.span_mm;
  }

  const CleanTap& clean_;
  const TapMotion& motion_;
  const SeenPress& press_;
  Stretch range_;
  double prior_s_;
  double backlash_mm_;
};

}  // namespace

LatencyEstimate EstimateLatency(const CleanTap& clean, const TapMotion& motion,
                                const SeenPress& press) {
  // Half of the range. It is also the fit's standard deviation, as some latencies are longer;
  // without information it is the range's own, uniform.
  const double prior_s = 0.5 * (kMaxPeriods * clean.period_s + kTransport_s);
  const LatencyEstimate unknown = {prior_s, prior_s / std::numbers::sqrt3};
  if (!motion.has_approach) {
    return unknown;
  }
  const Stretch range = Approach(clean, motion, press, 4 * prior_s);
  if (range.end < range.first + kMinBefore + kMinRest) {
    return unknown;
  }
  const double backlash_mm = BacklashAtRest(clean, motion, press);
  const double depth_mm = press.z0_mm + press.shape.t * press.span_mm - motion.halt_z_mm;
  const Fit fit(clean, motion, press, range, prior_s, backlash_mm);
  State state{1, prior_s, backlash_mm};
  // Less than this of the press would leave the priors to rounding.
  constexpr double kMinNoise = 1e-5;
  const double noise_g = std::max(press.noise_g, kMinNoise * press.shape.At(0));
  double variance = noise_g * noise_g;
  double deviation_s = prior_s;
  double apart_mm = kOffset_mm;
  const double samples = static_cast<double>(range.size());
  for (int step = 0; step < kMaxSteps; ++step) {
    Normal m = fit.Sum(state, variance);
    if (!Eliminate(m)) {
      return unknown;
    }
    const double rest = m[4][5];
    const double offset = m[3][5] - m[3][4] * rest;
    const double latency = m[2][5] - m[2][3] * offset - m[2][4] * rest;
    const double scale = m[1][5] - m[1][2] * latency - m[1][3] * offset - m[1][4] * rest;
    const double by_rest = m[2][3] * m[3][4] - m[2][4];
    deviation_s =
        std::sqrt(1 / m[2][2] + m[2][3] * m[2][3] / m[3][3] + by_rest * by_rest / m[4][4]);
    const double offset_variance = 1 / m[3][3] + m[3][4] * m[3][4] / m[4][4];
    state.rest_g += rest;
    state.scale = std::clamp(state.scale + scale, 0.3, 3.0);
    state.latency_s += std::clamp(latency, -prior_s, prior_s);
    state.offset_mm += std::clamp(offset, -kOffset_mm, kOffset_mm);
    apart_mm =
        std::hypot(state.offset_mm, std::sqrt(offset_variance), (state.scale - 1) * depth_mm);
    // The residual is the fit's noise, if it exceeds the pull-back's.
    const double left = m[kUnknowns][kUnknowns] * variance / std::max(1.0, samples - 1);
    variance = std::max(noise_g * noise_g, left);
    if (std::abs(latency) < 0.05 * deviation_s && step > 0) {
      break;
    }
  }
  const double backlash_s = kBacklash_mm * std::min(1.0, apart_mm / kOffset_mm) /
                            (motion.approach_speed_mm_s + motion.pull_back_speed_mm_s);
  const double uncertainty_s =
      std::hypot(deviation_s * std::sqrt(fit.Inflation(state)), backlash_s);
  return {state.latency_s, std::min(uncertainty_s, unknown.uncertainty_s)};
}

}  // namespace trammel::tap

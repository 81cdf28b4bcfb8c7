#include "tap/contact/free_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kMin = 16;  // samples that tell anything

Stretch Between(const CleanTap& clean, double from_s, double to_s) {
  const std::span<const float> times = clean.samples.time_s;
  const auto first = std::lower_bound(times.begin(), times.end(), from_s);
  const auto end = std::lower_bound(first, times.end(), to_s);
  return {static_cast<std::size_t>(first - times.begin()),
          static_cast<std::size_t>(end - times.begin())};
}

// Returns the stretches after the break and before the touch.
std::array<Stretch, 2> FreeRanges(const CleanTap& clean, const TapMotion& motion,
                                  const FreeNozzle& nozzle) {
  constexpr double kClear_mm = 0.01;  // bed clearance
  constexpr double kClearSamples = 4;
  const double shift_s = nozzle.latency_s - clean.origin_s;
  const double clear_s = kClearSamples * clean.period_s;
  const double clear_z_mm = nozzle.break_z_mm + kClear_mm;
  std::array<Stretch, 2> ranges{};
  ranges[0] = Between(clean, motion.CruiseTime(clear_z_mm) + clear_s + shift_s,
                      std::numeric_limits<double>::infinity());
  if (motion.has_approach) {
    const double touch_s =
        motion.approach_end_s - (clear_z_mm - motion.halt_z_mm) / motion.approach_speed_mm_s;
    ranges[1] =
        Between(clean, motion.approach_start_s + clear_s + shift_s, touch_s - clear_s + shift_s);
  }
  return ranges;
}

/// Straight line over the positions in a span.
struct Line {
  double middle = 0;
  double mean = 0;
  double slope = 0;

  template <class T>
  explicit Line(std::span<const T> values) {
    const auto n = static_cast<double>(values.size());
    middle = 0.5 * (n - 1);
    double sum = 0;
    double moment = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      sum += values[i];
      moment += (static_cast<double>(i) - middle) * values[i];
    }
    mean = sum / n;
    slope = moment * 12 / (n * (n * n - 1));
  }
  [[nodiscard]] double At(std::size_t i) const {
    return mean + slope * (static_cast<double>(i) - middle);
  }
};

// Tests by Box & Pierce's sum over a few lags.
bool IsCorrelated(std::span<const double> rest) {
  constexpr std::size_t kFew = 4;
  constexpr double kLimit = 14.9;  // exceeded by white noise in one stretch of 200
  const std::size_t n = rest.size();
  if (n < kMin) {
    return false;
  }
  std::array<double, kFew + 1> sum{};
  for (std::size_t i = kFew; i < n; ++i) {
    for (std::size_t lag = 0; lag <= kFew; ++lag) {
      sum[lag] += rest[i] * rest[i - lag];
    }
  }
  double squares = 0;
  for (std::size_t lag = 1; lag <= kFew; ++lag) {
    squares += sum[lag] * sum[lag];
  }
  return squares * static_cast<double>(n) > kLimit * sum[0] * sum[0];
}

// Tests the samples themselves, for hum and filters, and means over blocks of them, for slow noise.
// It runs on every tap, so that the fit's noise is the scale of wild samples.
bool IsCorrelated(std::span<const float> force, double noise_g, std::span<double> scratch) {
  constexpr double kWild = 6;
  constexpr std::size_t kBlocks = 20;
  const std::size_t n = force.size();
  if (n < kMin || scratch.size() < n) {
    return false;
  }
  const Line line(force);
  const double most = kWild * noise_g;
  for (std::size_t i = 0; i < n; ++i) {
    scratch[i] = std::clamp(force[i] - line.At(i), -most, most);
  }
  if (IsCorrelated(scratch.first(n))) {
    return true;
  }
  const std::size_t block = n / kBlocks;
  if (block < 2) {
    return false;
  }
  const std::size_t blocks = n / block;
  for (std::size_t k = 0; k < blocks; ++k) {
    double sum = 0;
    for (std::size_t i = 0; i < block; ++i) {
      sum += scratch[k * block + i];
    }
    scratch[k] = sum;
  }
  return IsCorrelated(scratch.first(blocks));
}

// Limits wild samples to four deviations from the line through the stretch.
void DrawIn(std::span<double> force, std::span<double> scratch) {
  constexpr double kMaxDeviations = 4;
  constexpr double kMedianOfNormal = 0.6745;
  const Line line{std::span<const double>(force)};
  for (std::size_t i = 0; i < force.size(); ++i) {
    scratch[i] = std::abs(force[i] - line.At(i));
  }
  const double median = UpperMedian(scratch.first(force.size()));
  const double most = kMaxDeviations * median / kMedianOfNormal;
  for (std::size_t i = 0; i < force.size(); ++i) {
    force[i] = std::clamp(force[i], line.At(i) - most, line.At(i) + most);
  }
}

// Returns the forces of a range without drift, hum and wild samples; empty if they are
// uninformative.
std::span<double> Cleaned(const CleanTap& clean, const Stretch& range, const FreeNozzle& nozzle,
                          Workspace& workspace) {
  const std::size_t n = range.size();
  const std::span<double> force = workspace.Take<double>(n);
  const Workspace::Scope scope(workspace);
  const std::span<double> time_s = workspace.Take<double>(n);
  const std::span<double> rest = workspace.Take<double>(n);
  if (n < kMin || rest.empty()) {
    return {};
  }
  for (std::size_t i = 0; i < n; ++i) {
    time_s[i] = clean.samples.time_s[range.first + i];
    force[i] = clean.samples.force_g[range.first + i] - nozzle.drift_g_s * time_s[i];
  }
  if (nozzle.hum.frequency_hz > 0) {
    const Line line{std::span<const double>(force)};
    std::transform(force.begin(), force.end(), rest.begin(),
                   [&line](double g) { return g - line.mean; });
    RemoveMainsHum(nozzle.hum, time_s, rest, force);
  }
  DrawIn(force, rest);
  return force;
}

}  // namespace

FreeSteps FindFreeSteps(const CleanTap& clean, const TapMotion& motion, const FreeNozzle& nozzle) {
  constexpr double kSignificant = 2.3;
  const std::array<Stretch, 2> ranges = FreeRanges(clean, motion, nozzle);
  const Stretch& before = ranges[1];
  FreeSteps steps;
  if (before.size() < kMin) {
    return steps;
  }
  // One drift for both stretches: the weighted mean of their drifts.
  double spread = 0;
  double drift = 0;
  double level = 0;
  double level_s = 0;
  for (const Stretch& range : ranges) {
    if (range.size() < kMin) {
      continue;
    }
    const Line line(clean.samples.force_g.subspan(range.first, range.size()));
    const auto times = clean.samples.time_s.subspan(range.first, range.size());
    const double period_s = (times.back() - times.front()) / static_cast<double>(range.size() - 1);
    const double n = static_cast<double>(range.size());
    const double weight = n * (n * n - 1) / 12 * period_s * period_s;
    spread += weight;
    drift += weight * line.slope / period_s;
    if (&range == &before) {
      level = line.mean + clean.origin_g;
      level_s = 0.5 * (times.back() + times.front());
    }
  }
  drift /= spread;
  double drift_variance = 1 / spread;  // for a noise of 1
  // The stretches' estimate of a drift scatters the step between them more than all else. An
  // insignificant drift is ignored: it then counts as a step.
  constexpr double kOfDrift = 2;
  if (!(std::abs(drift) > kOfDrift * nozzle.noise_g * std::sqrt(drift_variance))) {
    drift = drift_variance = 0;
  }
  const double break_s = motion.CruiseTime(nozzle.break_z_mm) + nozzle.latency_s - clean.origin_s;
  const double after = std::max(static_cast<double>(kMin), nozzle.fitted_s / clean.period_s);
  // Tests at the break and halfway after it: a thread pulls the more, the longer it gets.
  const double half_s =
      std::max(0.0, 0.5 * (motion.cruise_end_s - motion.CruiseTime(nozzle.break_z_mm)));
  for (const double later_s : {0.0, half_s}) {
    const double between_s = break_s + later_s - level_s;
    const double step = level + drift * between_s - (nozzle.level_g + nozzle.drift_g_s * later_s);
    const double deviation =
        nozzle.noise_g * std::sqrt(1 / static_cast<double>(before.size()) + 4 / after +
                                   between_s * between_s * drift_variance);
    if (std::abs(step) > kSignificant * deviation) {
      steps.most = std::max(steps.most, step);
      steps.least = std::min(steps.least, step);
    }
  }
  return steps;
}

double FreeNoiseFactor(const CleanTap& clean, const TapMotion& motion, const FreeNozzle& nozzle,
                       const BreakFit& fit, Workspace& workspace) {
  const Workspace::Scope scope(workspace);
  const std::array<Stretch, 2> ranges = FreeRanges(clean, motion, nozzle);
  bool correlated = nozzle.correlated;
  {
    const Workspace::Scope check(workspace);
    const std::span<double> scratch =
        workspace.Take<double>(std::max(ranges[0].size(), ranges[1].size()));
    for (const Stretch& range : ranges) {
      const auto force = clean.samples.force_g.subspan(range.first, range.size());
      correlated = correlated || IsCorrelated(force, nozzle.noise_g, scratch);
    }
  }
  if (!correlated) {
    return 1;
  }
  const std::array<std::span<double>, 2> free = {Cleaned(clean, ranges[0], nozzle, workspace),
                                                 Cleaned(clean, ranges[1], nozzle, workspace)};
  return CorrelatedFactor(fit, free, workspace);
}

}  // namespace trammel::tap

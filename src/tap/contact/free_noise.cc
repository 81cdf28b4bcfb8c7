#include "tap/contact/free_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kLeast = 16;  // samples that tell anything

Stretch Between(const CleanTap& clean, double from_s, double to_s) {
  const std::span<const float> times = clean.samples.time_s;
  const auto first = std::lower_bound(times.begin(), times.end(), from_s);
  const auto end = std::lower_bound(first, times.end(), to_s);
  return {static_cast<std::size_t>(first - times.begin()),
          static_cast<std::size_t>(end - times.begin())};
}

// After the break and before the touch.
std::array<Stretch, 2> FreeRanges(const CleanTap& clean, const TapMotion& motion,
                                  const FreeNozzle& nozzle) {
  constexpr double kClear_mm = 0.01;  // of the bed
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

/// Straight over the places in a span.
struct Line {
  double middle = 0;
  double mean = 0;
  double slope = 0;

  template <class T>
  explicit Line(std::span<const T> values) {
    // Runs side by side: one addition need not wait for the one before it.
    constexpr std::size_t kRuns = 4;
    const auto n = static_cast<double>(values.size());
    middle = 0.5 * (n - 1);
    std::array<double, kRuns> sums{};
    std::array<double, kRuns> moments{};
    std::array<double, kRuns> place{-middle, 1 - middle, 2 - middle, 3 - middle};
    std::size_t i = 0;
    for (; i + kRuns <= values.size(); i += kRuns) {
      for (std::size_t k = 0; k < kRuns; ++k) {
        const double value = values[i + k];
        sums[k] += value;
        moments[k] += place[k] * value;
        place[k] += kRuns;
      }
    }
    for (std::size_t k = 0; i < values.size(); ++i, ++k) {
      sums[k] += values[i];
      moments[k] += place[k] * values[i];
    }
    const double sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    const double moment = (moments[0] + moments[1]) + (moments[2] + moments[3]);
    mean = sum / n;
    slope = moment * 12 / (n * (n * n - 1));
  }
  [[nodiscard]] double At(std::size_t i) const {
    return mean + slope * (static_cast<int>(i) - middle);  // which a processor converts in pairs
  }
};

// The forces of a range about their straight line, without hum, wild samples drawn in to four
// deviations; empty where they tell nothing.
std::span<double> Cleaned(const CleanTap& clean, const Stretch& range, const MainsHum& hum,
                          Workspace& workspace) {
  constexpr double kMostDeviations = 4;
  constexpr double kMedianOfNormal = 0.6745;
  const std::size_t n = range.size();
  const std::span<double> force = workspace.Take<double>(n);
  const Workspace::Scope scope(workspace);
  const std::span<double> scratch = workspace.Take<double>(n);
  if (n < kLeast || scratch.empty()) {
    return {};
  }
  std::copy_n(clean.samples.force_g.begin() + static_cast<std::ptrdiff_t>(range.first), n,
              force.begin());
  const auto level = [&force] {
    const Line line{std::span<const double>(force)};
    for (std::size_t i = 0; i < force.size(); ++i) force[i] -= line.At(i);
  };
  level();
  const std::span<double> time_s = workspace.Take<double>(n);
  if (hum.frequency_hz > 0 && !time_s.empty()) {
    std::copy_n(clean.samples.time_s.begin() + static_cast<std::ptrdiff_t>(range.first), n,
                time_s.begin());
    std::copy(force.begin(), force.end(), scratch.begin());
    RemoveMainsHum(hum, time_s, scratch, force);
  }
  std::transform(force.begin(), force.end(), scratch.begin(), [](double g) { return std::abs(g); });
  const double most = kMostDeviations * UpperMedian(scratch) / kMedianOfNormal;
  for (double& g : force) g = std::clamp(g, -most, most);
  level();
  return force;
}

// Half the sum of squared differences between the means of neighbouring blocks.
double SumDifferences(std::span<const double> force, std::size_t block) {
  double sum = 0;
  double before = 0;
  for (std::size_t first = 0; first + block <= force.size(); first += block) {
    double mean = 0;
    for (const double g : force.subspan(first, block)) {
      mean += g / static_cast<double>(block);
    }
    sum += first > 0 ? 0.5 * (mean - before) * (mean - before) : 0;
    before = mean;
  }
  return sum;
}

}  // namespace

FreeSteps FindFreeSteps(const CleanTap& clean, const TapMotion& motion, const FreeNozzle& nozzle) {
  constexpr double kSignificant = 2.3;
  const std::array<Stretch, 2> ranges = FreeRanges(clean, motion, nozzle);
  const Stretch& before = ranges[1];
  FreeSteps steps;
  if (before.size() < kLeast) {
    return steps;
  }
  // One drift for both stretches: what each shows, weighted by how well it does.
  double spread = 0;
  double drift = 0;
  double level = 0;
  double level_s = 0;
  for (const Stretch& range : ranges) {
    if (range.size() < kLeast) {
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
  // What the stretches show of a drift scatters the step between them more than all else. Without
  // one that stands out there is none: a small drift then counts as a step.
  constexpr double kOfDrift = 2;
  if (!(std::abs(drift) > kOfDrift * nozzle.noise_g * std::sqrt(drift_variance))) {
    drift = drift_variance = 0;
  }
  const double break_s = motion.CruiseTime(nozzle.break_z_mm) + nozzle.latency_s - clean.origin_s;
  const double after = std::max(static_cast<double>(kLeast), nozzle.fitted_s / clean.period_s);
  // At the break and in the middle of what follows it: a thread pulls the more, the longer it gets.
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
                       std::size_t below, Workspace& workspace) {
  // Shares of the press: noise slower than its eighth shifts the whole end of it. By the study's
  // seeds below 1000.
  constexpr std::array<std::size_t, 2> kParts = {4, 16};
  constexpr double kLeastDifferences = 4;
  // Standard deviations of a mean square of differences, which white noise exceeds in one of 40.
  constexpr double kSignificant = 2;
  const std::array<Stretch, 2> ranges = FreeRanges(clean, motion, nozzle);
  double factor = 1;
  for (const std::size_t parts : kParts) {
    const std::size_t block = std::max<std::size_t>(1, below / parts);
    double sum = 0;
    double count = 0;
    for (const Stretch& range : ranges) {
      const Workspace::Scope scope(workspace);
      const std::span<const double> force = Cleaned(clean, range, nozzle.hum, workspace);
      if (force.empty()) {
        continue;
      }
      // A stretch may have more white noise than the pull-back, as the approach does.
      const double white =
          std::max(nozzle.noise_g * nozzle.noise_g,
                   SumDifferences(force, 1) / static_cast<double>(force.size() - 1));
      const std::size_t blocks = force.size() / block;
      sum += SumDifferences(force, block) * static_cast<double>(block) / white;
      count += static_cast<double>(blocks > 0 ? blocks - 1 : 0);
    }
    const double scatter = std::sqrt(3 / std::max(1.0, count));  // neighbours share a block
    if (count >= kLeastDifferences && sum / count > 1 + kSignificant * scatter) {
      factor = std::max(factor, sum / count);
    }
  }
  return factor;
}

}  // namespace trammel::tap

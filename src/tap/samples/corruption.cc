#include "tap/samples/corruption.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "tap/samples/clock_step.h"
#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

constexpr double kClipWidths = 2;  // of the pull-back: the write-up
// Start of the press before the pull-back, in its widths, if the approach is unknown.
constexpr double kUnknownDwellWidths = 4;
// Numbers of values for medians: of values, which scatter by a third of one value; of differences,
// by a fifth.
constexpr std::size_t kLevelSamples = 15;
constexpr std::size_t kNoiseSamples = 31;
// Median of |difference of two normal values| over their standard deviation: 0.6745 sqrt 2.
constexpr double kMedianDifference = 0.9539;
// Gap of a lost sample, in periods; times of real converters scatter by a tenth of a period.
constexpr double kGapPeriods = 1.75;
// Limits of a spike: ten deviations (none in 10^20 samples), a quarter of the press, and three
// samples, within which ringing after an impact does not return.
constexpr double kSpikeDeviations = 10;
constexpr double kSpikeOfPress = 0.25;
constexpr std::size_t kSpikeLength = 3;
// Probability that sound noise looks stuck or saturated.
constexpr double kFalseAlarm = 1e-4;
// If every other value equals the one before, steps of the converter hide the noise.
constexpr double kTiesOfCoarseSteps = 0.5;
constexpr double kTiesOfFineSteps = 0.1;
constexpr std::size_t kMinSaturated = 6;

Stretch Clip(const TapView& tap, const TapMotion& motion) {
  const double width_s = motion.pull_back_end_s - motion.pull_back_start_s;
  const double from_s = motion.has_approach
                            ? motion.approach_end_s - kClipWidths * width_s
                            : motion.pull_back_start_s - kUnknownDwellWidths * width_s;
  const double to_s = motion.pull_back_start_s + kClipWidths * width_s;
  const auto first = std::lower_bound(tap.time_s.begin(), tap.time_s.end(), from_s);
  const auto end = std::upper_bound(first, tap.time_s.end(), to_s);
  return {static_cast<std::size_t>(first - tap.time_s.begin()),
          static_cast<std::size_t>(end - tap.time_s.begin())};
}

// Returns the cruise; times count from the pull-back's start.
Stretch CruiseOf(std::span<const float> time_s, const TapMotion& motion) {
  return {IndexAt(time_s, motion.cruise_start_s - motion.pull_back_start_s),
          IndexAt(time_s, motion.cruise_end_s - motion.pull_back_start_s)};
}

// True if values repeat while the host reads on. At the pull-back's start, where the force falls,
// neighbours are then equal more often than step and noise explain. If steps are coarse compared
// with the changes there, equal neighbours prove nothing.
bool AreHeld(std::span<const float> time_s, std::span<const float> force_g) {
  constexpr std::size_t kMinTies = 2;
  constexpr double kFewTies = 0.05;
  constexpr double kCoarse = 0.3;  // the step, of the median change
  // Probability of a tie for fine steps: the density of changes at 0, at most 0.27 over their
  // median for noise alone; three times that is not by chance.
  constexpr double kNoChance = 3 * 0.27;
  if (force_g.size() < 2) {
    return false;
  }
  if (CountPairs(force_g, [](float a, float b) { return a == b; }) < kMinTies) {
    return false;
  }
  // Equal values at an extreme come from the converter's range.
  const auto [lowest, highest] = std::minmax_element(force_g.begin(), force_g.end());
  float least = std::numeric_limits<float>::infinity();
  std::array<float, kNoiseSamples> changes{};
  std::size_t count = 0;
  std::size_t ties = 0;
  for (std::size_t i = 1; i < force_g.size(); ++i) {
    const float change = std::abs(force_g[i] - force_g[i - 1]);
    if (change > 0) {
      least = std::min(least, change);
      changes[count++ % changes.size()] = change;
    } else {
      const bool extreme = force_g[i] == *lowest || force_g[i] == *highest;
      ties += extreme || !(time_s[i] > time_s[i - 1]) ? 0 : 1;
    }
  }
  if (ties < kMinTies) {
    return false;
  }
  if (count == 0) {
    return false;
  }
  const double median = MedianOver<kNoiseSamples>({0, std::min(count, changes.size())},
                                                  [&](std::size_t i) { return changes[i]; });
  const double share = static_cast<double>(ties) / static_cast<double>(force_g.size() - 1);
  return least < kCoarse * median && share > kNoChance * least / median + kFewTies;
}

// Drops held values: the first is the new one.
std::size_t DropHeld(std::span<float> time_s, std::span<float> force_g, const TapMotion& motion,
                     CleanTap& clean) {
  // Tests both ends of the cruise. At its start the force falls, so that coarse steps make no equal
  // neighbours; at its end it is flat, and there are more samples.
  constexpr std::size_t kPart = 4;
  const Stretch cruise = CruiseOf(time_s, motion);
  const std::size_t n = force_g.size();
  const std::size_t part = (cruise.end - cruise.first) / kPart;
  const auto held = [&](std::size_t first, std::size_t end) {
    return AreHeld(time_s.subspan(first, end - first), force_g.subspan(first, end - first));
  };
  if (!held(cruise.first, cruise.first + part) && !held(cruise.end - part, n)) {
    return n;
  }
  clean.held_s =
      MedianOver<kLevelSamples>({1, n}, [&](std::size_t i) { return time_s[i] - time_s[i - 1]; });
  std::size_t kept = 1;
  for (std::size_t i = 1; i < n; ++i) {
    if (force_g[i] != force_g[kept - 1] || !(time_s[i] > time_s[kept - 1])) {
      force_g[kept] = force_g[i];
      time_s[kept++] = time_s[i];
    }
  }
  clean.held = n - kept;
  return kept;
}

void FindGaps(std::span<const float> time_s, Stretch cruise, CleanTap& clean) {
  const auto limit = static_cast<float>(kGapPeriods * clean.period_s);
  clean.longest_gap_s = clean.period_s;
  clean.duplicated = CountPairs(time_s, [](float a, float b) { return !(b > a); });
  if (clean.duplicated > 0) {
    const std::size_t first = std::max<std::size_t>(cruise.first, 1) - 1;
    clean.duplicated_in_cruise =
        CountPairs(time_s.subspan(first, std::max(cruise.end, first) - first),
                   [](float a, float b) { return !(b > a); });
  }
  // Evenly spread delays of range J scatter the distances by J / sqrt(6).
  const double squares = SumPairs(time_s, [limit, period_s = clean.period_s](float a, float b) {
    const float step = b - a;
    const double off = step - period_s;
    return ((step > 0) & (step < limit)) ? off * off : 0;
  });
  const std::size_t even = CountPairs(time_s, [limit](float a, float b) { return b - a < limit; });
  clean.jitter_s = clean.held > 0 ? 0 : std::sqrt(6 * squares / static_cast<double>(even + 1));
  const std::size_t gaps = CountPairs(time_s, [limit](float a, float b) { return b - a > limit; });
  for (std::size_t i = 1; i < time_s.size() && gaps > 0 && clean.period_s > 0; ++i) {
    const float gap = time_s[i] - time_s[i - 1];
    if (gap > limit) {
      clean.dropped += static_cast<std::size_t>(std::lround(gap / clean.period_s)) - 1;
    }
    if (gap > clean.longest_gap_s) {
      clean.longest_gap_s = gap;
      clean.longest_gap_start_s = time_s[i - 1];
    }
  }
}

struct Run {
  std::size_t first = 0;
  std::size_t length = 1;
};

Run LongestRun(std::span<const float> force_g) {
  Run longest;
  Run now;
  for (std::size_t i = 1; i < force_g.size(); ++i) {
    now = force_g[i] == force_g[i - 1] ? Run{now.first, now.length + 1} : Run{i, 1};
    longest = now.length > longest.length ? now : longest;
  }
  return longest;
}

std::size_t Overlap(Stretch a, Stretch b) {
  const std::size_t first = std::max(a.first, b.first);
  const std::size_t end = std::min(a.end, b.end);
  return end > first ? end - first : 0;
}

void FindSaturation(std::span<const float> force_g, Stretch cruise, CleanTap& clean) {
  float lowest = force_g[0];
  float highest = force_g[0];
  for (const float force : force_g) {
    lowest = std::min(lowest, force);
    highest = std::max(highest, force);
  }
  for (const float extreme : {lowest, highest}) {
    const auto count =
        static_cast<std::size_t>(std::count(force_g.begin(), force_g.end(), extreme));
    // A saturated converter repeats its extreme; noise reaches it here and there.
    const std::size_t in_row =
        CountPairs(force_g, [extreme](float a, float b) { return a == extreme && b == extreme; });
    if (lowest < highest && count >= kMinSaturated && 3 * in_row > count &&
        count > clean.saturated) {
      clean.saturated = count;
      clean.saturated_in_cruise = static_cast<std::size_t>(
          std::count(force_g.begin() + static_cast<std::ptrdiff_t>(cruise.first),
                     force_g.begin() + static_cast<std::ptrdiff_t>(cruise.end), extreme));
    }
  }
}

// Detects a converter that repeats itself, or is full, if its step is finer than the noise. Chance
// makes such a run of equal neighbours once in 1 / kFalseAlarm taps.
void FindTies(std::span<const float> force_g, Stretch cruise, CleanTap& clean) {
  const std::size_t ties = CountPairs(force_g, [](float a, float b) { return a == b; });
  if (ties + 1 < kMinSaturated / 2) {
    return;
  }
  const Run run = LongestRun(force_g);
  const auto n = static_cast<double>(force_g.size());
  const auto others = static_cast<double>(force_g.size() - run.length);
  const double tie_chance = (static_cast<double>(ties - (run.length - 1)) + 1) / (others + 1);
  if (tie_chance > kTiesOfCoarseSteps) {
    return;
  }
  if (tie_chance <= kTiesOfFineSteps) {
    FindSaturation(force_g, cruise, clean);
  }
  const double chance = n * std::pow(tie_chance, static_cast<double>(run.length - 1));
  if (chance < kFalseAlarm && clean.saturated < run.length) {
    clean.stuck = run.length;
    clean.stuck_in_cruise = Overlap(cruise, {run.first, run.first + run.length});
  }
}

// Sets samples to NaN that leave their neighbourhood and return within kSpikeLength.
// @param moving_g  Noise before the collision: the way down is faster and shakes the cell.
void MarkSpikes(std::span<float> force_g, double moving_g, Stretch collision, Stretch cruise,
                CleanTap& clean) {
  const double press_g = std::abs(clean.dwell_g - clean.departure_g);
  const double min_g = kSpikeOfPress * (press_g > 0 ? press_g : 0);
  const auto limit = static_cast<float>(std::max(kSpikeDeviations * clean.noise_g, min_g));
  const auto moving_limit = std::max(limit, static_cast<float>(kSpikeDeviations * moving_g));
  const std::size_t jumps =
      CountPairs(force_g, [limit](float a, float b) { return std::abs(b - a) > limit; });
  if (jumps == 0 || !(limit > 0)) {
    return;
  }
  float first_value = 0;
  clean.spikes_are_equal = true;
  for (std::size_t i = 1; i < force_g.size(); ++i) {
    const float before = force_g[i - 1];
    const float jump = force_g[i] - before;
    if (!(std::abs(jump) > (i < collision.first ? moving_limit : limit)) ||
        (i >= collision.first && i < collision.end)) {
      continue;
    }
    std::size_t back = i + 1;
    while (back < force_g.size() && back <= i + kSpikeLength &&
           std::abs(force_g[back] - before) > 0.3F * std::abs(jump)) {
      ++back;
    }
    if (back == force_g.size() || back > i + kSpikeLength) {
      continue;  // a step, not a spike
    }
    for (std::size_t k = i; k < back; ++k) {
      first_value = clean.spikes == 0 ? force_g[k] : first_value;
      clean.spikes_are_equal = clean.spikes_are_equal && force_g[k] == first_value;
      force_g[k] = std::numeric_limits<float>::quiet_NaN();
      ++clean.spikes;
      clean.spikes_in_cruise += k >= cruise.first && k < cruise.end ? 1 : 0;
    }
    i = back;
  }
  clean.spikes_are_equal = clean.spikes_are_equal && clean.spikes > 1;
}

std::size_t Compact(std::span<float> time_s, std::span<float> force_g) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (std::isnan(force_g[i]) || (kept > 0 && !(time_s[i] > time_s[kept - 1]))) {
      continue;
    }
    time_s[kept] = time_s[i];
    force_g[kept++] = force_g[i];
  }
  return kept;
}

void FindLevels(std::span<const float> time_s, std::span<const float> force_g, Stretch cruise,
                std::size_t halt, std::size_t pull_back, CleanTap& clean) {
  const std::size_t n = time_s.size();
  const auto force = [&](std::size_t i) { return force_g[i]; };
  clean.noise_g =
      MedianOver<kNoiseSamples>(
          {1, n}, [&](std::size_t i) { return std::abs(force_g[i] - force_g[i - 1]); }) /
      kMedianDifference;
  clean.approach_g = MedianOver<kLevelSamples>({0, halt - halt / 3}, force);
  clean.dwell_g = MedianOver<kLevelSamples>({pull_back - (pull_back - halt) / 2, pull_back}, force);
  clean.departure_g =
      MedianOver<kLevelSamples>({cruise.end - (cruise.end - cruise.first) / 7, n}, force);
}

}  // namespace

std::size_t CleanWorkspaceBytes(std::size_t samples) {
  constexpr std::size_t kAlignmentSlack = 128;
  return 2 * sizeof(float) * samples + kAlignmentSlack;
}

CleanTap CleanSamples(const TapView& tap, const TapMotion& motion, Workspace& workspace) {
  CleanTap clean;
  const Stretch clip = Clip(tap, motion);
  std::size_t n = clip.end - clip.first;
  std::span<float> time_s = workspace.Take<float>(n);
  std::span<float> force_g = workspace.Take<float>(n);
  constexpr std::size_t kMin = 3;
  clean.memory_suffices = time_s.size() == n && force_g.size() == n;
  if (n < kMin || !clean.memory_suffices) {
    return clean;
  }
  clean.origin_s = motion.pull_back_start_s;
  clean.origin_g = tap.force_g[(clip.first + clip.end) / 2];
  for (std::size_t i = 0; i < n; ++i) {
    time_s[i] = static_cast<float>(tap.time_s[clip.first + i] - clean.origin_s);
    force_g[i] = static_cast<float>(tap.force_g[clip.first + i] - clean.origin_g);
  }
  n = DropHeld(time_s, force_g, motion, clean);
  time_s = time_s.first(n);
  force_g = force_g.first(n);
  clean.period_s =
      MedianOver<kLevelSamples>({1, n}, [&](std::size_t i) { return time_s[i] - time_s[i - 1]; });
  clean.clock_steps = TakeOutClockSteps(time_s, clean.period_s);
  const Stretch cruise = CruiseOf(time_s, motion);
  const std::size_t pull_back = IndexAt(time_s, 0);
  const std::size_t halt =
      motion.has_approach ? IndexAt(time_s, motion.approach_end_s - clean.origin_s) : 0;
  FindLevels(time_s, force_g, cruise, halt, pull_back, clean);
  FindGaps(time_s, cruise, clean);
  const double moving_g = halt < 2 ? 0 : MedianOver<kNoiseSamples>({1, halt}, [&](std::size_t i) {
                                           return std::abs(force_g[i] - force_g[i - 1]);
                                         }) / kMedianDifference;
  // Forces jump around the halt.
  const std::size_t around = 2 + (pull_back - halt) / 8;
  MarkSpikes(force_g, moving_g, {halt - std::min(halt, around), halt + around}, cruise, clean);
  const std::size_t kept = clean.spikes + clean.duplicated > 0 ? Compact(time_s, force_g) : n;
  clean.samples = {time_s.first(kept), force_g.first(kept)};
  const float least = LeastChange(force_g.first(kept));
  clean.step_g = least < std::numeric_limits<float>::infinity() ? least : 0;
  if (kept > 0) {
    FindTies(force_g.first(kept), kept < n ? CruiseOf(clean.samples.time_s, motion) : cruise,
             clean);
  }
  return clean;
}

}  // namespace trammel::tap

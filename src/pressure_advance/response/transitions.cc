#include "pressure_advance/response/transitions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

std::string Describe(const LineMotion& motion) {
  std::vector<std::string> parts;
  for (const Segment& segment : motion.segments) {
    parts.push_back(fmt::format("{}:{}", segment.fraction, segment.speed_mm_s));
  }
  return fmt::format("{}", fmt::join(parts, ","));
}

// True if the fast segment is long enough for the acceleration's lag to pass and a steady middle to
// follow.
bool HasSteadyMiddle(const LineMotion& motion, double longest_lag_s,
                     const TransitionOptions& options) {
  if (!motion.length_mm) return true;
  const Segment& fast = motion.segments[1];
  const double slow_mm_s = motion.segments[0].speed_mm_s;
  const double ramp_mm = motion.acceleration_mm_s2
                             ? (fast.speed_mm_s * fast.speed_mm_s - slow_mm_s * slow_mm_s) /
                                   (2 * *motion.acceleration_mm_s2)
                             : 0;
  const double middle_mm = options.plateau_begin * fast.fraction * *motion.length_mm;
  return middle_mm >= ramp_mm + 4 * longest_lag_s * fast.speed_mm_s;
}

}  // namespace

Result<TransitionPlan> PlanTransitions(const LineMotion& motion, PositionUnit unit,
                                       double longest_lag_s, const TransitionOptions& options) {
  const std::vector<Segment>& segments = motion.segments;
  if (!IsSlowFastSlow(segments)) {
    return Fail(
        fmt::format("segments {}: the response needs a slow, a fast and a slow one, for example "
                    "0.25:5,0.5:150,0.25:5",
                    Describe(motion)));
  }
  const auto ramp_mm = [&](double slow_mm_s) {
    const double fast_mm_s = segments[1].speed_mm_s;
    return motion.acceleration_mm_s2
               ? (fast_mm_s * fast_mm_s - slow_mm_s * slow_mm_s) / (2 * *motion.acceleration_mm_s2)
               : 0;
  };
  if (auto too_short = FindShortFastSegment(motion)) return Fail(std::move(*too_short));
  TRAMMEL_CHECK(unit == PositionUnit::kLineLength || motion.length_mm.has_value(),
                "positions in mm need the line's length");
  const double length = unit == PositionUnit::kLineLength ? 1.0 : *motion.length_mm;
  const double rise = segments[0].fraction * length;
  const double fall = rise + segments[1].fraction * length;
  const double slow_after = length - fall;

  const double before = std::min(options.before * length, rise / 4);
  double after = options.after * length;
  if (motion.length_mm) {
    const double lag_mm = std::max(options.after_mm, 4 * longest_lag_s * segments[2].speed_mm_s);
    after = std::max(after, lag_mm * length / *motion.length_mm);
  }
  after = std::min(after, 0.6 * slow_after);
  const double margin = options.end_margin * length;
  const double fast = fall - rise;
  const bool middle = HasSteadyMiddle(motion, longest_lag_s, options);
  const double first_end = rise + (middle ? options.plateau_begin : options.split) * fast;
  const double second_begin = rise + (middle ? options.plateau_end : options.split) * fast;

  const auto ramp = [&](double slow_mm_s) {
    return motion.length_mm ? ramp_mm(slow_mm_s) * length / *motion.length_mm : 0;
  };
  TransitionPlan plan;
  plan.steady_middle = middle;
  plan.acceleration = {{rise - before, first_end},
                       rise,
                       segments[1].speed_mm_s - segments[0].speed_mm_s,
                       first_end - rise,
                       ramp(segments[0].speed_mm_s)};
  plan.deceleration = {{second_begin, fall + after},
                       fall,
                       segments[2].speed_mm_s - segments[1].speed_mm_s,
                       fall - second_begin,
                       ramp(segments[2].speed_mm_s)};
  if (!middle && first_end <= fall - plan.deceleration.ramp_length) {
    plan.early = {plan.acceleration.span.lo, rise + options.early_end * (first_end - rise)};
  }
  const Interval last{fall + after, length - margin};
  const double begin = motion.length_mm
                           ? std::max(margin, options.start_margin_mm * length / *motion.length_mm)
                           : margin;
  const Interval first{std::min(begin, rise - before), rise - before};
  plan.reference = {middle ? Interval{first_end, second_begin} : first, last};
  return plan;
}

Interval SettledLines(double lag_s, std::vector<double> pa_s, const TransitionPlan& plan,
                      double unit_mm, double slow_mm_s) {
  TRAMMEL_CHECK(lag_s > 0 && !pa_s.empty(), "lag {} s, {} lines", lag_s, pa_s.size());
  constexpr double kEven = 0.01;  // of the slow flow
  constexpr std::size_t kFewest = 4;
  const double after_s =
      (plan.reference.back().lo - plan.deceleration.boundary) * unit_mm / slow_mm_s;
  const double per_s = slow_mm_s / std::abs(plan.deceleration.speed_change_mm_s);
  const double drains_s = kEven * lag_s * std::exp(after_s / lag_s);
  const double refills_s = drains_s < lag_s ? drains_s : after_s + lag_s * (1 + std::log(kEven));
  std::ranges::sort(pa_s, {}, [&](double pa) { return std::abs(pa - lag_s); });
  const double near_s = std::abs(pa_s[std::min(kFewest, pa_s.size()) - 1] - lag_s);
  return {lag_s - std::max(near_s, drains_s * per_s), lag_s + std::max(near_s, refills_s * per_s)};
}

namespace {

// Returns relative readings of one line, averaged per bin; not finite for an empty bin.
std::vector<double> Binned(const LineProfile& profile, Reading reading, const Interval& window,
                           int bins) {
  std::vector<double> sum(bins, 0.0), count(bins, 0.0), all;
  for (const ProfileSample& sample : profile.samples) {
    const Seen& seen = sample.Read(reading);
    if (!seen.seen() || sample.gap) continue;
    all.push_back(seen.value);
    const double at = (sample.position - window.lo) / (window.hi - window.lo) * bins;
    if (!(at >= 0 && at < bins)) continue;
    sum[static_cast<std::size_t>(at)] += seen.value;
    count[static_cast<std::size_t>(at)] += 1;
  }
  const double level = all.empty() ? 0 : Median(all);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] = level > 0 && count[i] > 0 ? sum[i] / count[i] / level : std::nan("");
  }
  return sum;
}

}  // namespace

std::optional<Interval> RespondingStretch(const std::vector<LineProfile>& profiles, Reading reading,
                                          const Interval& window, bool rising, double margin) {
  constexpr int kBins = 60;           // over the window
  constexpr double kThreshold = 0.2;  // of the strongest answer: where the stretch ends
  std::vector<double> pa;
  std::vector<std::vector<double>> lines;
  for (const LineProfile& profile : profiles) {
    if (!profile.unusable.empty()) continue;
    pa.push_back(profile.pressure_advance_s);
    lines.push_back(Binned(profile, reading, window, kBins));
  }
  if (pa.size() < 3) return std::nullopt;
  std::vector<double> raw(kBins);
  for (std::size_t bin = 0; bin < raw.size(); ++bin) {
    std::vector<double> readings;
    for (const std::vector<double>& line : lines) readings.push_back(line[bin]);
    raw[bin] = MedianSlope(pa, readings) * (rising ? 1 : -1);
  }
  std::vector<double> answer(raw.size());
  for (std::size_t bin = 0; bin < raw.size(); ++bin) {
    const std::size_t before = bin == 0 ? 0 : bin - 1;
    const std::size_t after = std::min(bin + 1, raw.size() - 1);
    answer[bin] = (raw[before] + raw[bin] + raw[after]) / 3;
  }
  const auto strongest = std::max_element(answer.begin(), answer.end());
  constexpr double kStandsOut = 3;
  if (!(*strongest > kStandsOut * std::abs(Median(answer)))) return std::nullopt;
  const double least = kThreshold * *strongest;
  auto first = strongest;
  while (first != answer.begin() && *(first - 1) > least) --first;
  auto last = strongest;
  while (last + 1 != answer.end() && *(last + 1) > least) ++last;
  const double bin_length = (window.hi - window.lo) / kBins;
  const double lo = window.lo + bin_length * static_cast<double>(first - answer.begin());
  const double hi = window.lo + bin_length * static_cast<double>(last + 1 - answer.begin());
  const double beside = margin * (hi - lo);
  return Interval{std::max(window.lo, lo - beside), std::min(window.hi, hi + beside)};
}

std::string NameUnseenStretch(const std::vector<std::optional<double>>& frame_positions_mm,
                              const TransitionPlan& plan) {
  constexpr double kUsualSteps = 3;
  std::vector<double> seen;
  for (const std::optional<double>& position : frame_positions_mm) {
    if (position) seen.push_back(*position);
  }
  if (seen.size() < 2) return {};
  std::sort(seen.begin(), seen.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < seen.size(); ++i) steps.push_back(seen[i] - seen[i - 1]);
  const double usual_mm = kUsualSteps * Median(steps);
  for (const TransitionWindow* window : {&plan.acceleration, &plan.deceleration}) {
    const Interval& span = window->span;
    const double max_mm = std::max(usual_mm, kMaxUnread * (span.hi - span.lo));
    double from = span.lo;
    for (std::size_t i = 0; i <= seen.size(); ++i) {
      const double to = i < seen.size() ? std::clamp(seen[i], span.lo, span.hi) : span.hi;
      if (to - from > max_mm) {
        return fmt::format("no frame shows the line from {:.3g} to {:.3g} mm", from, to);
      }
      from = std::max(from, to);
    }
  }
  return {};
}

}  // namespace trammel::pressure_advance

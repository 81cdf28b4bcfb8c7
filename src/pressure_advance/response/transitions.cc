#include "pressure_advance/response/transitions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "base/check.h"

namespace trammel::pressure_advance {
namespace {

std::string Describe(const LineMotion& motion) {
  std::vector<std::string> parts;
  for (const Segment& segment : motion.segments) {
    parts.push_back(fmt::format("{}:{}", segment.fraction, segment.speed_mm_s));
  }
  return fmt::format("{}", fmt::join(parts, ","));
}

// Whether the fast segment is long enough for the acceleration's lag to pass and leave a steady
// middle.
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

}  // namespace trammel::pressure_advance

#include "pressure_advance/transitions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

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

}  // namespace

Result<TransitionPlan> PlanTransitions(const LineMotion& motion, PositionUnit unit,
                                       double longest_lag_s, const TransitionOptions& options) {
  const std::vector<Segment>& segments = motion.segments;
  if (segments.size() != 3 || segments[1].speed_mm_s <= segments[0].speed_mm_s ||
      segments[1].speed_mm_s <= segments[2].speed_mm_s) {
    return Fail(
        fmt::format("segments {}: the response needs a slow, a fast and a slow one, for example "
                    "0.25:5,0.5:150,0.25:5",
                    Describe(motion)));
  }
  TRAMMEL_CHECK(unit == PositionUnit::kLineLength || motion.length_mm.has_value(),
                "positions in mm need the line's length");
  const double length = unit == PositionUnit::kLineLength ? 1.0 : *motion.length_mm;
  const double rise = segments[0].fraction * length;
  const double fall = rise + segments[1].fraction * length;
  const double slow_after = length - fall;

  const double before = std::min(options.before * length, rise / 4);
  double after = options.after * length;
  if (motion.length_mm) {
    const double lag_mm = 4 * longest_lag_s * segments[2].speed_mm_s;
    after = std::max(after, lag_mm * length / *motion.length_mm);
  }
  after = std::min(after, 0.6 * slow_after);
  const double split = rise + options.split * (fall - rise);
  const double margin = options.end_margin * length;

  TransitionPlan plan;
  plan.acceleration = {
      {rise - before, split}, rise, segments[1].speed_mm_s - segments[0].speed_mm_s, split - rise};
  plan.deceleration = {
      {split, fall + after}, fall, segments[2].speed_mm_s - segments[1].speed_mm_s, fall - split};
  plan.reference = {{margin, rise - before}, {fall + after, length - margin}};
  return plan;
}

}  // namespace trammel::pressure_advance

#include "pressure_advance/profile/line_profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trammel::pressure_advance {

bool IsSlowFastSlow(const std::vector<Segment>& segments) {
  return segments.size() == 3 && segments[1].speed_mm_s > segments[0].speed_mm_s &&
         segments[1].speed_mm_s > segments[2].speed_mm_s;
}

std::optional<std::string> FindShortFastSegment(const LineMotion& motion) {
  const std::vector<Segment>& segments = motion.segments;
  if (!IsSlowFastSlow(segments) || !motion.length_mm || !motion.acceleration_mm_s2) {
    return std::nullopt;
  }
  const Segment& fast = segments[1];
  const double fast_mm = fast.fraction * *motion.length_mm;
  // Share of the fast segment in which a speed change must end.
  struct Ramp {
    double slow_mm_s = 0;
    double share = 0;
  };
  double highest_mm_s = std::numeric_limits<double>::infinity();
  double lowest_mm_s2 = 0;
  for (const Ramp& ramp : {Ramp{segments[0].speed_mm_s, kSplitOfFastSegment},
                           Ramp{segments[2].speed_mm_s, 1 - kSplitOfFastSegment}}) {
    const double slow2 = ramp.slow_mm_s * ramp.slow_mm_s;
    const double room_mm = ramp.share * fast_mm;
    highest_mm_s =
        std::min(highest_mm_s, std::sqrt(slow2 + 2 * *motion.acceleration_mm_s2 * room_mm));
    lowest_mm_s2 =
        std::max(lowest_mm_s2, (fast.speed_mm_s * fast.speed_mm_s - slow2) / (2 * room_mm));
  }
  constexpr double kRounding = 1e-9;
  if (lowest_mm_s2 <= *motion.acceleration_mm_s2 * (1 + kRounding)) return std::nullopt;
  // Rounded towards the permitted side.
  return fmt::format(
      "the fast segment of {:.3g} mm is too short for a steady stretch at {:.4g} mm/s: at {:.4g} "
      "mm/s^2, speeding up may take {:.0f} % of it and slowing down {:.0f} %; take at most {:g} "
      "mm/s, at least {:.0f} mm/s^2, or lines of at least {:.0f} mm",
      fast_mm, fast.speed_mm_s, *motion.acceleration_mm_s2, 100 * kSplitOfFastSegment,
      100 * (1 - kSplitOfFastSegment), std::floor(10 * highest_mm_s) / 10,
      10 * std::ceil(lowest_mm_s2 / 10),
      std::ceil(*motion.length_mm * lowest_mm_s2 / *motion.acceleration_mm_s2));
}

std::optional<Reading> ChooseReading(const std::vector<LineProfile>& profiles) {
  std::size_t area = 0;
  std::size_t width = 0;
  for (const LineProfile& profile : profiles) {
    for (const ProfileSample& sample : profile.samples) {
      area += sample.area.seen();
      width += sample.width.seen();
    }
  }
  if (area == 0 && width == 0) return std::nullopt;
  return 2 * area >= width ? Reading::kArea : Reading::kWidth;
}

}  // namespace trammel::pressure_advance

#include "pressure_advance/report/speed_profile.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace trammel::report {
namespace {

constexpr int kPoints = 400;

/// Speed that a move may have `distance_mm` after (or before) it had `speed_mm_s`.
double Reachable(double speed_mm_s, double distance_mm, double acceleration_mm_s2) {
  return std::sqrt(speed_mm_s * speed_mm_s + 2 * acceleration_mm_s2 * distance_mm);
}

}  // namespace

std::vector<DataPoint> SpeedAlongLine(const pressure_advance::LineMotion& motion, bool in_mm) {
  const auto& segments = motion.segments;
  if (segments.empty() || (in_mm && !motion.length_mm)) {
    return {};
  }
  const bool ramps = motion.length_mm && motion.acceleration_mm_s2;
  const double length = motion.length_mm.value_or(1.0);
  std::vector<DataPoint> curve;
  for (int i = 0; i <= kPoints; ++i) {
    const double at = static_cast<double>(i) / kPoints;
    // The lowest speed that any segment allows here: its own inside, a ramp away from it outside.
    double speed = std::numeric_limits<double>::infinity();
    double begin = 0;
    for (std::size_t k = 0; k < segments.size(); ++k) {
      const double end = k + 1 < segments.size() ? begin + segments[k].fraction : 1.0;
      const bool inside = at >= begin && (at < end || k + 1 == segments.size());
      const double distance_mm = std::max({0.0, begin - at, at - end}) * length;
      if (inside) {
        speed = std::min(speed, segments[k].speed_mm_s);
      } else if (ramps) {
        speed = std::min(
            speed, Reachable(segments[k].speed_mm_s, distance_mm, *motion.acceleration_mm_s2));
      }
      begin = end;
    }
    if (!std::isfinite(speed)) {
      return {};
    }
    curve.push_back({in_mm ? at * length : at, speed});
  }
  return curve;
}

}  // namespace trammel::report

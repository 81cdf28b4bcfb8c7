#include "gcode/move_time.h"

#include <algorithm>
#include <cmath>

namespace trammel::gcode {

double MoveTime_s(double length_mm, double enter_mm_s, double cruise_mm_s, double leave_mm_s,
                  double acceleration_mm_s2) {
  if (length_mm <= 0) return 0;
  const double peak_mm_s =
      std::min(cruise_mm_s, std::sqrt(acceleration_mm_s2 * length_mm +
                                      (enter_mm_s * enter_mm_s + leave_mm_s * leave_mm_s) / 2));
  const double ramps_mm =
      (2 * peak_mm_s * peak_mm_s - enter_mm_s * enter_mm_s - leave_mm_s * leave_mm_s) /
      (2 * acceleration_mm_s2);
  return (2 * peak_mm_s - enter_mm_s - leave_mm_s) / acceleration_mm_s2 +
         std::max(0.0, length_mm - ramps_mm) / peak_mm_s;
}

double MoveTime_s(double length_mm, double cruise_mm_s, double acceleration_mm_s2) {
  return MoveTime_s(length_mm, 0, cruise_mm_s, 0, acceleration_mm_s2);
}

}  // namespace trammel::gcode

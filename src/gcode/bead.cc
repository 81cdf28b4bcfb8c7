#include "gcode/bead.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace trammel::gcode {

double BeadArea_mm2(double width_mm, double height_mm) {
  TRAMMEL_CHECK(height_mm > 0 && width_mm >= height_mm, "width = {} mm, height = {} mm", width_mm,
                height_mm);
  return height_mm * (width_mm - height_mm * kRoundSideLoss);
}

double FilamentPerMm(double width_mm, double height_mm, double filament_diameter_mm) {
  TRAMMEL_CHECK(filament_diameter_mm > 0, "filament_diameter = {} mm", filament_diameter_mm);
  const double filament_area_mm2 =
      std::numbers::pi / 4 * filament_diameter_mm * filament_diameter_mm;
  return BeadArea_mm2(width_mm, height_mm) / filament_area_mm2;
}

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

#include "gcode/bead.h"

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

}  // namespace trammel::gcode

#include "pressure_advance/pattern_placeholders.h"

#include "gcode/number.h"
#include "pressure_advance/pattern_geometry.h"

namespace trammel::pressure_advance {

std::vector<gcode::Placeholder> PatternPlaceholders(const PatternConfig& config) {
  const BoundsMm printed = OuterBounds(config);
  const auto number = [](double value) { return gcode::FormatNumber(value, 4); };
  return {
      {"nozzle_temperature_c", number(config.nozzle_temperature_c)},
      {"idle_nozzle_temperature_c", number(config.idle_nozzle_temperature_c)},
      {"bed_temperature_c", number(config.bed_temperature_c)},
      {"nozzle_diameter_mm", number(config.nozzle_diameter_mm)},
      {"filament_diameter_mm", number(config.filament_diameter_mm)},
      {"layer_height_mm", number(config.layer_height_mm)},
      {"line_width_mm", number(config.line_width_mm)},
      {"retract_length_mm", number(config.retract_length_mm)},
      {"acceleration_mm_s2", number(config.acceleration_mm_s2)},
      {"min_x_mm", number(printed.min_x_mm)},
      {"min_y_mm", number(printed.min_y_mm)},
      {"max_x_mm", number(printed.max_x_mm)},
      {"max_y_mm", number(printed.max_y_mm)},
      {"bed_min_x_mm", number(config.bed_origin_x_mm)},
      {"bed_min_y_mm", number(config.bed_origin_y_mm)},
      {"bed_max_x_mm", number(config.bed_origin_x_mm + config.bed_size_x_mm)},
      {"bed_max_y_mm", number(config.bed_origin_y_mm + config.bed_size_y_mm)},
  };
}

}  // namespace trammel::pressure_advance

#include "pressure_advance/pattern/pattern_placeholders.h"

#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::pressure_advance {

std::vector<gcode::Placeholder> PatternPlaceholders(const PatternConfig& config) {
  const BoundsMm printed = OuterBounds(config);
  return settings::Placeholders(
      config, config,
      {config.layer_height_mm, config.line_width_mm, config.acceleration_mm_s2, printed.min_x_mm,
       printed.min_y_mm, printed.max_x_mm, printed.max_y_mm});
}

}  // namespace trammel::pressure_advance

// What a user's own start, end and idle G-code may name.
#pragma once

#include <vector>

#include "gcode/placeholders.h"
#include "pressure_advance/pattern/pattern_config.h"

namespace trammel::pressure_advance {

/// Every {name} with its value, units in the name.
[[nodiscard]] std::vector<gcode::Placeholder> PatternPlaceholders(const PatternConfig& config);

}  // namespace trammel::pressure_advance

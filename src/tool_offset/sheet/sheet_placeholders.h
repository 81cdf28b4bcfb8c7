// What a user's own G-code may name.
#pragma once

#include <cstddef>
#include <vector>

#include "gcode/placeholders.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// For start and end G-code: the names that every calibration knows, the nozzle temperature being
/// the reference tool's.
[[nodiscard]] std::vector<gcode::Placeholder> SheetPlaceholders(const SheetPlan& plan);

/// For tool changes, priming and wiping: also {tool}, {extruder} (Klipper's name of its extruder),
/// {previous_tool} and {tool_temperature_c}.
/// @param place, previous  places in `tools`.
[[nodiscard]] std::vector<gcode::Placeholder> ToolPlaceholders(const SheetPlan& plan,
                                                               std::size_t place,
                                                               std::size_t previous);

/// The place of the reference tool in `tools`. REQUIRES that it is among them.
[[nodiscard]] std::size_t ReferencePlace(const SheetSettings& settings);

}  // namespace trammel::tool_offset

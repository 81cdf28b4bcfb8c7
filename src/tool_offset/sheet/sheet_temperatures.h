// Temperatures of tools, and the placeholders of start and end G-code.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "gcode/dialect.h"
#include "settings/setting.h"
#include "tool_offset/sheet/sheet_plan.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {

/// A bed and a nozzle that hands may touch: ISO 13732-1 has burns of the first minute begin at
/// 51 °C on bare metal.
inline constexpr double kTouchableBed_c = 40;
inline constexpr double kTouchableNozzle_c = 50;

/// The filament as it is printed on paper: with the reference tool's nozzle temperature, and a bed
/// no warmer than kWarmestPaper_c.
[[nodiscard]] settings::FilamentSettings OnPaper(const SheetSettings& settings);

/// A temperature that neither a material nor a setting tells. REQUIRES settings without another
/// problem.
[[nodiscard]] std::optional<settings::SettingProblem> FindTemperatureProblem(
    const SheetSettings& settings);

/// Of a tool, given by its place in `tools`. REQUIRES no FindTemperatureProblem.
[[nodiscard]] double ToolTemperature_c(const SheetSettings& settings, std::size_t place);
[[nodiscard]] double ToolIdleTemperature_c(const SheetSettings& settings, std::size_t place);

/// For people: "pla: nozzle 215, bed 60 degC"; each tool's where they are listed, and what the bed
/// would have without paper. REQUIRES as above.
[[nodiscard]] std::string DescribeTemperatures(const SheetSettings& settings);

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

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

/// Maximum temperatures of a bed and a nozzle that hands may touch: by ISO 13732-1, burns within a
/// minute begin at 51 °C on bare metal.
inline constexpr double kTouchableBed_c = 40;
inline constexpr double kTouchableNozzle_c = 50;

/// Returns the filament for print on paper: with the reference tool's nozzle temperature, and a bed
/// no warmer than kWarmestPaper_c.
[[nodiscard]] settings::FilamentSettings OnPaper(const SheetSettings& settings);

/// Finds a temperature that neither a material nor a setting defines. REQUIRES settings without
/// another problem.
[[nodiscard]] std::optional<settings::SettingProblem> FindTemperatureProblem(
    const SheetSettings& settings);

/// Returns a tool's temperature, by its index in `tools`. REQUIRES no FindTemperatureProblem.
[[nodiscard]] double ToolTemperature_c(const SheetSettings& settings, std::size_t place);
[[nodiscard]] double ToolIdleTemperature_c(const SheetSettings& settings, std::size_t place);

/// Describes for people: "pla: nozzle 215, bed 60 degC"; each tool's if listed, and the bed's
/// without paper. REQUIRES as above.
[[nodiscard]] std::string DescribeTemperatures(const SheetSettings& settings);

/// Returns the placeholders of start and end G-code: those common to all calibrations, with the
/// reference tool's nozzle temperature.
[[nodiscard]] std::vector<gcode::Placeholder> SheetPlaceholders(const SheetPlan& plan);

/// Returns the placeholders of tool changes, priming and wiping: also {tool}, {extruder} (Klipper's
/// name of its extruder), {previous_tool} and {tool_temperature_c}.
/// @param place, previous  indices in `tools`.
[[nodiscard]] std::vector<gcode::Placeholder> ToolPlaceholders(const SheetPlan& plan,
                                                               std::size_t place,
                                                               std::size_t previous);

/// Returns the index of the reference tool in `tools`. REQUIRES that it is among them.
[[nodiscard]] std::size_t ReferencePlace(const SheetSettings& settings);

}  // namespace trammel::tool_offset

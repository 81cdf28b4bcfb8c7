// Pressure advance over flow and acceleration, from the recordings of several calibrations.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/flow/flow_table.h"

namespace trammel::app {

/// The table of what recordings keep as their answers, by the flows and accelerations of their
/// plans. Errors: a folder without either, or without a good answer; one named twice; another
/// filament, nozzle or printer than the others'.
[[nodiscard]] Result<pressure_advance::FlowTable> TableOf(
    const std::vector<std::string>& recordings);

/// As `pa table --json` has it (docs/formats.md).
[[nodiscard]] nlohmann::ordered_json TableJson(const pressure_advance::FlowTable& table);

/// As text on standard output.
/// @param filament_diameter_mm  > 0; firmware counts flow in mm of filament
void PrintTable(const pressure_advance::FlowTable& table, double filament_diameter_mm);

}  // namespace trammel::app

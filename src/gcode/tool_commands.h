// Commands for machines with several tools.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gcode/dialect.h"

namespace trammel::gcode {

/// Sets a tool's temperature without waiting, whether it is picked up or not; 0 switches it off.
[[nodiscard]] std::string ToolTemperatureCommand(Dialect dialect, int tool, double temperature_c);

/// Sets a tool's temperature and waits for it. Lines, without line ends.
[[nodiscard]] std::vector<std::string> HeatToolCommands(Dialect dialect, int tool,
                                                        double temperature_c);

/// Shows a text and waits until somebody says to go on. Quotes and control characters in it become
/// blanks. Lines, without line ends.
[[nodiscard]] std::vector<std::string> PauseCommands(Dialect dialect, std::string_view text);

/// The extruder that belongs to a tool, as Klipper names it: "extruder", "extruder1", …
[[nodiscard]] std::string KlipperExtruder(int tool);

}  // namespace trammel::gcode

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

/// Switches the bed off and waits until it is no warmer than this. Lines, without line ends.
[[nodiscard]] std::vector<std::string> CoolBedCommands(Dialect dialect, double at_most_c);

/// Switches a tool off and waits until it is no warmer than this. Lines, without line ends.
[[nodiscard]] std::vector<std::string> CoolToolCommands(Dialect dialect, int tool,
                                                        double at_most_c);

/// Shows a text and waits until somebody says to go on. Quotes and control characters in it become
/// blanks. A Klipper without [pause_resume], which would run on, ends the print with an error
/// instead. Lines, without line ends.
[[nodiscard]] std::vector<std::string> PauseCommands(Dialect dialect, std::string_view text);

/// The extruder that belongs to a tool, as Klipper names it: "extruder", "extruder1", …
[[nodiscard]] std::string KlipperExtruder(int tool);

}  // namespace trammel::gcode

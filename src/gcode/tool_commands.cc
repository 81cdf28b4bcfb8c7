#include "gcode/tool_commands.h"

#include <fmt/format.h>

#include <algorithm>

#include "gcode/number.h"

namespace trammel::gcode {
namespace {

constexpr int kTemperatureDecimals = 1;

}  // namespace

std::string ToolTemperatureCommand(Dialect dialect, int tool, double temperature_c) {
  const std::string value = FormatNumber(temperature_c, kTemperatureDecimals);
  if (dialect == Dialect::kRepRapFirmware) {
    // Active and standby alike: which of them counts depends on what is picked up.
    return fmt::format("G10 P{} S{} R{}", tool, value, value);
  }
  return fmt::format("M104 T{} S{}", tool, value);
}

std::vector<std::string> HeatToolCommands(Dialect dialect, int tool, double temperature_c) {
  if (dialect == Dialect::kRepRapFirmware) {
    return {ToolTemperatureCommand(dialect, tool, temperature_c), fmt::format("M116 P{}", tool)};
  }
  return {fmt::format("M109 T{} S{}", tool, FormatNumber(temperature_c, kTemperatureDecimals))};
}

std::vector<std::string> CoolBedCommands(Dialect dialect, double at_most_c) {
  const std::string value = FormatNumber(at_most_c, kTemperatureDecimals);
  if (dialect == Dialect::kKlipper) {
    return {"M140 S0", "TEMPERATURE_WAIT SENSOR=heater_bed MAXIMUM=" + value};
  }
  // R waits for cooling as well; a bed that is colder is warmed up to it first.
  return {"M140 S0", "M190 R" + value, "M140 S0"};
}

std::vector<std::string> CoolToolCommands(Dialect dialect, int tool, double at_most_c) {
  const std::string value = FormatNumber(at_most_c, kTemperatureDecimals);
  const std::string off = ToolTemperatureCommand(dialect, tool, 0);
  switch (dialect) {
    case Dialect::kKlipper:
      return {off,
              fmt::format("TEMPERATURE_WAIT SENSOR={} MAXIMUM={}", KlipperExtruder(tool), value)};
    case Dialect::kMarlin:
      return {off, fmt::format("M109 T{} R{}", tool, value), off};
    case Dialect::kRepRapFirmware:
      return {ToolTemperatureCommand(dialect, tool, at_most_c), fmt::format("M116 P{}", tool), off};
  }
  return {};
}

std::vector<std::string> PauseCommands(Dialect dialect, std::string_view text) {
  std::string clean(text);
  std::replace_if(
      clean.begin(), clean.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '"'; }, ' ');
  switch (dialect) {
    case Dialect::kKlipper:
      // A pause that somebody cancelled by a macro of their own would make PAUSE do nothing. PAUSE
      // saves a state; where there is no PAUSE, Klipper says so and runs on, until it is to bring
      // back a state that was never saved: that is an error and ends the print.
      return {DisplayCommand(clean), "CLEAR_PAUSE", "PAUSE",
              "; without [pause_resume] the print ends at the next line, with an error",
              "RESTORE_GCODE_STATE NAME=PAUSE_STATE MOVE=0"};
    case Dialect::kMarlin:
      return {"M0 " + clean};
    case Dialect::kRepRapFirmware:
      return {fmt::format("M291 P\"{}\" R\"trammel\" S3", clean)};
  }
  return {};
}

std::string KlipperExtruder(int tool) {
  return tool == 0 ? "extruder" : fmt::format("extruder{}", tool);
}

}  // namespace trammel::gcode

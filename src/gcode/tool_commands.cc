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

std::vector<std::string> PauseCommands(Dialect dialect, std::string_view text) {
  std::string clean(text);
  std::replace_if(
      clean.begin(), clean.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '"'; }, ' ');
  switch (dialect) {
    case Dialect::kKlipper:
      return {DisplayCommand(clean), "PAUSE"};
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

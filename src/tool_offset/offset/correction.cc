#include "tool_offset/offset/correction.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "base/check.h"

namespace trammel::tool_offset {
namespace {

using enum OffsetFirmware;

constexpr std::array<std::pair<OffsetFirmware, std::string_view>, 4> kNames = {{
    {kKlipperTool, "klipper-tool"},
    {kKlipperGcodeOffset, "klipper-gcode-offset"},
    {kMarlin, "marlin"},
    {kRepRapFirmware, "reprapfirmware"},
}};

// Formats in micrometres; never "-0.000".
std::string Number(double value_mm) {
  const double rounded = std::round(1000 * value_mm) / 1000;
  return fmt::format("{:.3f}", rounded == 0 ? 0.0 : rounded);
}

}  // namespace

std::string_view ToString(OffsetFirmware firmware) {
  for (const auto& [value, name] : kNames) {
    if (value == firmware) return name;
  }
  return "";
}

std::optional<OffsetFirmware> ParseOffsetFirmware(std::string_view name) {
  for (const auto& [value, known] : kNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

KeptOffset Corrected(OffsetFirmware firmware, const KeptOffset& now, double dx_mm, double dy_mm) {
  const bool klipper = firmware == kKlipperTool || firmware == kKlipperGcodeOffset;
  const double sign = klipper ? -1 : 1;
  return {now.x_mm + sign * dx_mm, now.y_mm + sign * dy_mm};
}

std::vector<std::string> SetCommands(OffsetFirmware firmware, int tool, const KeptOffset& offset) {
  TRAMMEL_CHECK(tool >= 0 && tool <= 99 && std::isfinite(offset.x_mm) && std::isfinite(offset.y_mm),
                "tool {}, {}, {}", tool, offset.x_mm, offset.y_mm);
  const std::string x = Number(offset.x_mm);
  const std::string y = Number(offset.y_mm);
  switch (firmware) {
    case kKlipperTool:
      return {fmt::format("SET_TOOL_PARAMETER T={} PARAMETER=gcode_x_offset VALUE={}", tool, x),
              fmt::format("SET_TOOL_PARAMETER T={} PARAMETER=gcode_y_offset VALUE={}", tool, y)};
    case kKlipperGcodeOffset:
      return {fmt::format("SET_GCODE_OFFSET X={} Y={}", x, y)};
    case kMarlin:
      return {fmt::format("M218 T{} X{} Y{}", tool, x, y)};
    case kRepRapFirmware:
      return {fmt::format("G10 P{} X{} Y{}", tool, x, y)};
  }
  return {};
}

std::vector<std::string> SaveCommands(OffsetFirmware firmware, int tool) {
  switch (firmware) {
    case kKlipperTool:
      return {fmt::format("SAVE_TOOL_PARAMETER T={} PARAMETER=gcode_x_offset", tool),
              fmt::format("SAVE_TOOL_PARAMETER T={} PARAMETER=gcode_y_offset", tool)};
    case kMarlin:
      return {"M500"};
    case kRepRapFirmware:
      return {"M500 P10"};
    case kKlipperGcodeOffset:
      break;
  }
  return {};
}

std::string SaveAdvice(OffsetFirmware firmware, int tool, const KeptOffset& offset) {
  if (firmware == kKlipperTool) {
    return "then SAVE_CONFIG, which writes what is pending to printer.cfg and restarts Klipper";
  }
  if (firmware != kKlipperGcodeOffset) return {};
  return fmt::format("in [gcode_macro T{}] of printer.cfg:  {}", tool,
                     SetCommands(firmware, tool, offset).front());
}

}  // namespace trammel::tool_offset

#include "gcode/dialect.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>
#include <utility>

#include "gcode/number.h"

namespace trammel::gcode {
namespace {

constexpr int kAccelerationDecimals = 1;
constexpr int kRatioDecimals = 3;

constexpr std::array<std::pair<Dialect, std::string_view>, 3> kNames{{
    {Dialect::kKlipper, "klipper"},
    {Dialect::kMarlin, "marlin"},
    {Dialect::kRepRapFirmware, "reprapfirmware"},
}};

}  // namespace

std::string_view ToString(Dialect dialect) {
  for (const auto& [value, name] : kNames) {
    if (value == dialect) return name;
  }
  return "";
}

std::optional<Dialect> ParseDialect(std::string_view name) {
  for (const auto& [value, known] : kNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

std::vector<std::string> PressureAdvanceCommands(Dialect dialect, double pressure_advance_s,
                                                 const AdvanceMotors& motors) {
  return PressureAdvanceCommands(
      dialect, FormatNumber(pressure_advance_s, kPressureAdvanceDecimals), motors);
}

std::vector<std::string> PressureAdvanceCommands(Dialect dialect, std::string_view value,
                                                 const AdvanceMotors& motors) {
  switch (dialect) {
    case Dialect::kKlipper: {
      if (motors.names.empty()) return {fmt::format("SET_PRESSURE_ADVANCE ADVANCE={}", value)};
      std::vector<std::string> lines;
      for (const std::string& name : motors.names) {
        lines.push_back(fmt::format("SET_PRESSURE_ADVANCE EXTRUDER={} ADVANCE={}", name, value));
      }
      return lines;
    }
    case Dialect::kMarlin:
      return {fmt::format("M900 K{}", value)};
    case Dialect::kRepRapFirmware:
      return {fmt::format("M572 D{} S{}", motors.drive, value)};
  }
  return {};
}

SelectedTool ToolSelectedBy(std::string_view gcode) {
  SelectedTool selected;
  while (!gcode.empty()) {
    std::string_view line = gcode.substr(0, gcode.find('\n'));
    gcode.remove_prefix(std::min(gcode.size(), line.size() + 1));
    line = line.substr(0, line.find(';'));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) continue;
    line = line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin);
    const std::string_view word = line.substr(0, line.find_first_of(" \t"));
    if (word == "M98") {  // a macro of RepRapFirmware, which may select any
      if (!selected.number) selected.unknown = line;
    } else if (word.front() == 'T' || word.front() == 't') {
      int number = 0;
      const char* const end = word.data() + word.size();
      const auto [read, error] = std::from_chars(word.data() + 1, end, number);
      const bool whole = error == std::errc{} && read == end;
      // T words such as TIMELAPSE_START are macros of Klipper.
      if (whole && number >= 0) {
        selected = {number, {}};
      } else if (whole || word.size() == 1 || word[1] == '{' || word[1] == '[') {
        selected = {{}, std::string(line)};
      }
    }
  }
  return selected;
}

std::string LimitCommand(Dialect dialect, double acceleration_mm_s2,
                         std::optional<double> minimum_cruise_ratio) {
  const std::string acceleration = FormatNumber(acceleration_mm_s2, kAccelerationDecimals);
  if (dialect != Dialect::kKlipper) return fmt::format("M204 P{0} T{0}", acceleration);
  std::string command = "SET_VELOCITY_LIMIT ACCEL=" + acceleration;
  if (minimum_cruise_ratio) {
    command +=
        " MINIMUM_CRUISE_RATIO=" + FormatNumber(*minimum_cruise_ratio, kRatioDecimals) +
        " ACCEL_TO_DECEL=" +
        FormatNumber(acceleration_mm_s2 * (1 - *minimum_cruise_ratio), kAccelerationDecimals);
  }
  return command;
}

std::vector<std::string> SaveStateCommands(Dialect dialect) {
  switch (dialect) {
    case Dialect::kKlipper:
      return {"SAVE_GCODE_STATE NAME=trammel_pattern",
              "_TRAMMEL_KEEP_SETTINGS ; limits and pressure advance, by klipper/trammel.cfg"};
    case Dialect::kRepRapFirmware:
      return {"M120"};
    case Dialect::kMarlin:
      return {};
  }
  return {};
}

std::vector<std::string> RestoreStateCommands(Dialect dialect) {
  switch (dialect) {
    case Dialect::kKlipper:
      return {"RESTORE_GCODE_STATE NAME=trammel_pattern", "_TRAMMEL_BRING_BACK_SETTINGS"};
    case Dialect::kRepRapFirmware:
      return {"M121"};
    case Dialect::kMarlin:
      return {};
  }
  return {};
}

std::string DescribeAfterwards(Dialect dialect, const std::vector<ChangedSetting>& changed) {
  std::string all, values;
  for (const ChangedSetting& one : changed) {
    all += fmt::format("{}{}", all.empty() ? "" : " and ", one.words);
    values += fmt::format(
        "{}{} {}", values.empty() ? "" : ", ", one.words,
        one.back ? "is set to " + FormatNumber(*one.back, 5)
                 : fmt::format("stays at {} (set {})", FormatNumber(one.left, 5), one.key));
  }
  if (dialect != Dialect::kKlipper) {
    return values + "; speed and flow factors stay at 100 %";
  }
  return fmt::format(
      "{} where Klipper has klipper/trammel.cfg; else {}",
      all + (changed.size() == 1 ? " comes back as it was" : " come back as they were"), values);
}

std::string WaitForMovesCommand() { return "M400"; }

std::string DisplayCommand(std::string_view text) {
  std::string clean(text);
  std::replace_if(
      clean.begin(), clean.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == ';'; }, ' ');
  return "M117 " + clean;
}

}  // namespace trammel::gcode

#include "gcode/dialect.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include "base/check.h"

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
      // Other words with T, such as TIMELAPSE_START, are macros of Klipper.
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

std::string FormatNumber(double value, int decimals) {
  TRAMMEL_CHECK(std::isfinite(value) && std::abs(value) < 1e12 && decimals >= 0 && decimals <= 9,
                "value = {}, decimals = {}", value, decimals);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

namespace {

long LineOf(std::string_view text, std::size_t position) {
  return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(position), '\n');
}

tl::unexpected<Error> FailUnknown(std::string_view name, long line,
                                  std::span<const Placeholder> known) {
  std::string names;
  for (const Placeholder& placeholder : known) {
    names += fmt::format("{}{{{}}}", names.empty() ? "" : " ", placeholder.name);
  }
  return Fail(
      fmt::format("line {}: unknown placeholder {{{}}}; known are {} (write {{{{ and }}}} "
                  "for braces)",
                  line, name, names));
}

}  // namespace

Result<std::string> ExpandPlaceholders(std::string_view text, std::span<const Placeholder> known) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c != '{' && c != '}') {
      out += c;
      continue;
    }
    if (i + 1 < text.size() && text[i + 1] == c) {
      out += c;
      ++i;
      continue;
    }
    const std::size_t end = c == '{' ? text.find_first_of("{}\n", i + 1) : std::string_view::npos;
    if (end == std::string_view::npos || text[end] != '}') {
      return Fail(
          fmt::format("line {}: a brace '{}' without its partner; write it twice where "
                      "the brace itself is meant",
                      LineOf(text, i), c));
    }
    const std::string_view name = text.substr(i + 1, end - i - 1);
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&](const Placeholder& p) { return p.name == name; });
    if (found == known.end()) return FailUnknown(name, LineOf(text, i), known);
    out += found->value;
    i = end;
  }
  return out;
}

namespace {

constexpr int kTemperatureDecimals = 1;

}  // namespace

std::string ToolTemperatureCommand(Dialect dialect, int tool, double temperature_c) {
  const std::string value = FormatNumber(temperature_c, kTemperatureDecimals);
  if (dialect == Dialect::kRepRapFirmware) {
    // Sets both active and standby temperature: which one counts depends on the mounted tool.
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
  // R also waits for cooling; a colder bed is first heated up.
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
      // A pause cancelled by a user's own macro would make PAUSE do nothing. PAUSE saves a state;
      // without PAUSE, Klipper reports an unknown command and continues, until it has to restore a
      // state that was never saved. That is an error and ends the print.
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

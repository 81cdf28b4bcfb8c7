#include "gcode/dialect.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include "base/check.h"

namespace trammel::gcode {
namespace {

constexpr int kAccelerationDecimals = 1;
constexpr int kRatioDecimals = 3;

constexpr std::string_view kModes =
    "G21 ; mm\n"
    "G90 ; absolute positions\n"
    "M82 ; absolute E\n"
    "M220 S100 ; speeds as written, whatever override was left over\n"
    "M221 S100 ; so is the filament\n"
    "G92 E0\n"
    "M107 ; no fan on a first layer";

// The nozzle waits for the bed at a temperature at which it does not ooze.
constexpr std::string_view kStart =
    "M140 S{bed_temperature_c}\n"
    "M104 S{idle_nozzle_temperature_c}\n"
    "G28\n"
    "M190 S{bed_temperature_c}\n"
    "M109 S{nozzle_temperature_c}\n";
constexpr std::string_view kEnd =
    "M104 S0\n"
    "M140 S0\n"
    "M84\n";

// Limit of the patterns' values. Klipper's SET_PRESSURE_ADVANCE (klippy/kinematics/extruder.py) and
// RepRapFirmware's M572 (Move::ConfigurePressureAdvance) have no upper one.
constexpr double kPatternMax_s = 10;

constexpr std::array<FirmwareWords, 5> kFirmwares{{
    {.dialect = Dialect::kKlipper,
     .name = "klipper",
     .title = "Klipper",
     .advance = "SET_PRESSURE_ADVANCE ADVANCE={value}",
     .advance_of_motor = "SET_PRESSURE_ADVANCE EXTRUDER={motor} ADVANCE={value}",
     .advance_note = "",
     .max_advance_s = kPatternMax_s,
     .keep = "pressure_advance under [extruder] in printer.cfg",
     .transfer = "",
     .modes = kModes,
     .acceleration = "SET_VELOCITY_LIMIT ACCEL={acceleration}",
     .save_state = "SAVE_GCODE_STATE NAME=trammel_pattern\n"
                   "_TRAMMEL_KEEP_SETTINGS ; limits and pressure advance, by klipper/trammel.cfg",
     .restore_state = "RESTORE_GCODE_STATE NAME=trammel_pattern\n"
                      "_TRAMMEL_BRING_BACK_SETTINGS",
     .display = "M117",
     .start_gcode = kStart,
     .end_gcode = kEnd,
     .writes_tool_offsets = true},
    // Marlin/src/gcode/feature/advance/M900.cpp: K out of 0-10 is not set.
    {.dialect = Dialect::kMarlin,
     .name = "marlin",
     .title = "Marlin",
     .advance = "M900 K{value}",
     .advance_of_motor = "",
     .advance_note = "",
     .max_advance_s = 10,
     .keep = "M500, where the printer has an EEPROM, or the same line in the slicer's start G-code",
     .transfer = "",
     .modes = kModes,
     .acceleration = "M204 P{acceleration} T{acceleration}",
     .save_state = "",
     .restore_state = "",
     .display = "M117",
     .start_gcode = kStart,
     .end_gcode = kEnd,
     .writes_tool_offsets = true},
    {.dialect = Dialect::kRepRapFirmware,
     .name = "reprapfirmware",
     .title = "RepRapFirmware",
     .advance = "M572 D{drive} S{value}",
     .advance_of_motor = "",
     .advance_note = "D is the extruder's drive",
     .max_advance_s = kPatternMax_s,
     .keep = "the same line in config.g",
     .transfer = "",
     .modes = kModes,
     .acceleration = "M204 P{acceleration} T{acceleration}",
     .save_state = "M120",
     .restore_state = "M121",
     .display = "M117",
     .start_gcode = kStart,
     .end_gcode = kEnd,
     .writes_tool_offsets = true},
    // Prusa-Firmware-Buddy, lib/Marlin/Marlin/src/gcode: M572 has no extruder ("D" is reported as
    // not supported), accepts S 0-10 and keeps its smooth time without W. M120 and M121 switch
    // endstops there. Start and end follow PrusaSlicer's profiles: M555 limits the probing of
    // G29 P1 to the print; Z stays powered at the end, since it holds the bed.
    {.dialect = Dialect::kPrusa,
     .name = "prusa",
     .title = "Prusa Buddy",
     .advance = "M572 S{value}",
     .advance_of_motor = "",
     .advance_note = "",
     .max_advance_s = 10,
     .keep = "the same line in the filament's start G-code instead of the slicer's own M572 "
             "(PrusaSlicer: Filament Settings, Custom G-code), or OrcaSlicer's Pressure advance",
     .transfer = "by USB stick, or uploaded by hand in PrusaLink; clean the nozzle before, since "
                 "it may be the bed's probe. On an XL let start_gcode pick the tool",
     .modes = kModes,
     .acceleration = "M204 P{acceleration} T{acceleration}",
     .save_state = "",
     .restore_state = "",
     .display = "M117",
     .start_gcode = "M17\n"
                    "M140 S{bed_temperature_c}\n"
                    "M104 S{idle_nozzle_temperature_c}\n"
                    "G28\n"
                    "M190 S{bed_temperature_c}\n"
                    "M555 X{min_x_mm} Y{min_y_mm} W{size_x_mm} H{size_y_mm}\n"
                    "G29 P1\n"
                    "G29 P3.2\n"
                    "G29 P3.13\n"
                    "G29 A\n"
                    "M109 S{nozzle_temperature_c}\n",
     .end_gcode = "M104 S0\n"
                  "M140 S0\n"
                  "M107\n"
                  "M84 X Y E\n"},
    // Bambu documents no G-code: these are the commands of Bambu Studio's own files (machine start
    // and end templates, GCodeWriter), whose E is relative. K: Bambu Studio asks for less than 2
    // (CalibUtils, MAX_PA_K_VALUE). The nozzle is heated behind G28, which there refuses a hot one
    // without T. G29.2 S1 uses the stored bed mesh; M975 S1 switches vibration compensation on. The
    // profiles exclude the bed's front left 18 x 28 mm, where the head runs against its cutter.
    {.dialect = Dialect::kBambu,
     .name = "bambu",
     .title = "Bambu",
     .advance = "M900 K{value} L1000 M10",
     .advance_of_motor = "",
     .advance_note = "",
     .max_advance_s = 1.99999,
     .keep = "OrcaSlicer's Pressure advance of the filament, or the same line at the end of the "
             "filament's start G-code in Bambu Studio; print with Flow Dynamics Calibration off, "
             "which sets its own K",
     .transfer = "in the top folder of the printer's SD card, started on its screen, with the "
                 "filament loaded before. A printer that lists .gcode.3mf files alone does not "
                 "show it: trammel writes none. Not tried on a printer",
     .modes = "G21 ; mm\n"
              "G90 ; absolute positions\n"
              "M83 ; relative E\n"
              "M220 S100 ; speeds as written, whatever override was left over\n"
              "M221 S100 ; so is the filament\n"
              "G92 E0\n"
              "M106 S0 ; no fan on a first layer",
     .relative_filament = true,
     .acceleration = "M204 S{acceleration}",
     .save_state = "",
     .restore_state = "",
     .display = "",
     .start_gcode = "M140 S{bed_temperature_c}\n"
                    "M104 S0\n"
                    "G29.2 S1\n"
                    "G28\n"
                    "M975 S1\n"
                    "M190 S{bed_temperature_c}\n"
                    "M109 S{nozzle_temperature_c}\n",
     .end_gcode = "M400\n"
                  "M104 S0\n"
                  "M140 S0\n"
                  "M106 S0\n",
     .cutter_in_corner = true},
}};

std::vector<std::string> Lines(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    lines.emplace_back(text.substr(0, text.find('\n')));
    text.remove_prefix(std::min(text.size(), lines.back().size() + 1));
  }
  return lines;
}

}  // namespace

std::span<const FirmwareWords> Firmwares() { return kFirmwares; }

const FirmwareWords& WordsOf(Dialect dialect) {
  const auto found = std::ranges::find(kFirmwares, dialect, &FirmwareWords::dialect);
  TRAMMEL_CHECK(found != kFirmwares.end(), "dialect {}", static_cast<int>(dialect));
  return *found;
}

std::string_view ToString(Dialect dialect) { return WordsOf(dialect).name; }

std::optional<Dialect> ParseDialect(std::string_view name) {
  const auto found = std::ranges::find(kFirmwares, name, &FirmwareWords::name);
  return found == kFirmwares.end() ? std::nullopt : std::optional(found->dialect);
}

std::string DialectNames(std::string_view quote) {
  std::string names;
  for (const FirmwareWords& firmware : kFirmwares) {
    const bool last = &firmware == &kFirmwares.back();
    names += fmt::format("{}{}{}{}",
                         names.empty() ? ""
                         : last        ? " or "
                                       : ", ",
                         quote, firmware.name, quote);
  }
  return names;
}

std::vector<std::string> PressureAdvanceCommands(Dialect dialect, double pressure_advance_s,
                                                 const AdvanceMotors& motors) {
  return PressureAdvanceCommands(
      dialect, FormatNumber(pressure_advance_s, kPressureAdvanceDecimals), motors);
}

std::vector<std::string> PressureAdvanceCommands(Dialect dialect, std::string_view value,
                                                 const AdvanceMotors& motors) {
  const FirmwareWords& words = WordsOf(dialect);
  const auto line = [&](std::string_view text, std::string_view motor) {
    return fmt::format(fmt::runtime(text), fmt::arg("value", value), fmt::arg("motor", motor),
                       fmt::arg("drive", motors.drive));
  };
  if (motors.names.empty() || words.advance_of_motor.empty()) return {line(words.advance, "")};
  std::vector<std::string> lines;
  for (const std::string& name : motors.names) lines.push_back(line(words.advance_of_motor, name));
  return lines;
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
  std::string command = fmt::format(
      fmt::runtime(WordsOf(dialect).acceleration),
      fmt::arg("acceleration", FormatNumber(acceleration_mm_s2, kAccelerationDecimals)));
  if (dialect == Dialect::kKlipper && minimum_cruise_ratio) {
    command +=
        " MINIMUM_CRUISE_RATIO=" + FormatNumber(*minimum_cruise_ratio, kRatioDecimals) +
        " ACCEL_TO_DECEL=" +
        FormatNumber(acceleration_mm_s2 * (1 - *minimum_cruise_ratio), kAccelerationDecimals);
  }
  return command;
}

std::vector<std::string> ModeCommands(Dialect dialect) { return Lines(WordsOf(dialect).modes); }

std::vector<std::string> SaveStateCommands(Dialect dialect) {
  return Lines(WordsOf(dialect).save_state);
}

std::vector<std::string> RestoreStateCommands(Dialect dialect) {
  return Lines(WordsOf(dialect).restore_state);
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

std::vector<std::string> DisplayCommands(Dialect dialect, std::string_view text) {
  const std::string_view command = WordsOf(dialect).display;
  if (command.empty()) return {};
  std::string clean(text);
  std::replace_if(
      clean.begin(), clean.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == ';'; }, ' ');
  return {fmt::format("{}{}{}", command, clean.empty() ? "" : " ", clean)};
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
    case Dialect::kPrusa:
    case Dialect::kBambu:
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
      return {DisplayCommands(dialect, clean).front(), "CLEAR_PAUSE", "PAUSE",
              "; without [pause_resume] the print ends at the next line, with an error",
              "RESTORE_GCODE_STATE NAME=PAUSE_STATE MOVE=0"};
    case Dialect::kMarlin:
    case Dialect::kPrusa:
      return {"M0 " + clean};
    case Dialect::kBambu:
      return {"M400 U1"};  // Bambu Studio's pause; it shows no text
    case Dialect::kRepRapFirmware:
      return {fmt::format("M291 P\"{}\" R\"trammel\" S3", clean)};
  }
  return {};
}

std::string KlipperExtruder(int tool) {
  return tool == 0 ? "extruder" : fmt::format("extruder{}", tool);
}

}  // namespace trammel::gcode

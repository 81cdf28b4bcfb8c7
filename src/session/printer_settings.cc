#include "session/printer_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include "base/text.h"

namespace trammel::procedure {
namespace {

using files::SettingValues;
using machine::PrinterState;

constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

// Name and command of a setting. A command that is no parameter of another is complete.
struct Kind {
  std::string_view name;
  std::string_view words;
  std::string_view unit;
  std::string_view parameter;  // parameter of the setting command; empty: ModeLine
};

constexpr std::array<Kind, 12> kKinds = {{
    {"max_velocity", "velocity limit", " mm/s", "VELOCITY"},
    {"max_accel", "acceleration limit", " mm/s2", "ACCEL"},
    {"square_corner_velocity", "corner velocity", " mm/s", "SQUARE_CORNER_VELOCITY"},
    {"minimum_cruise_ratio", "minimum cruise ratio", "", "MINIMUM_CRUISE_RATIO"},
    {"pressure_advance", "pressure advance of ", " s", "ADVANCE"},
    {"smooth_time", "smooth time of ", " s", "SMOOTH_TIME"},
    {"target", "target of ", " degC", "TARGET"},
    {"absolute_coordinates", "absolute positions", "", ""},
    {"absolute_extrude", "absolute E", "", ""},
    {"speed_factor", "speed factor", "", ""},
    {"extrude_factor", "extrude factor", "", ""},
    {"offset", "G-code offset ", " mm", ""},
}};

struct Split {
  std::string kind;
  std::string section;  // empty: it is no section's
};

Split SplitName(const std::string& name) {
  const std::size_t blank = name.find(' ');
  return {name.substr(0, blank), blank == std::string::npos ? "" : name.substr(blank + 1)};
}

const Kind* KindOf(const std::string& kind) {
  const auto found =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const Kind& k) { return k.name == kind; });
  return found == kKinds.end() ? nullptr : &*found;
}

std::string ModeLine(const std::string& kind, double value) {
  if (kind == "absolute_coordinates") return value > 0 ? "G90" : "G91";
  if (kind == "absolute_extrude") return value > 0 ? "M82" : "M83";
  if (kind == "speed_factor") return fmt::format("M220 S{:.6g}", 100 * value);
  if (kind == "extrude_factor") return fmt::format("M221 S{:.6g}", 100 * value);
  return "";
}

// Returns the command that has a setting as a parameter.
std::string CommandOf(const Split& name) {
  if (name.section.empty()) return "SET_VELOCITY_LIMIT";
  const std::string object = machine::NameInGcode(name.section);
  return (name.kind == "target" ? "SET_HEATER_TEMPERATURE HEATER="
                                : "SET_PRESSURE_ADVANCE EXTRUDER=") +
         object;
}

/// Line of G-code: "G1" with X -> "5", "SET_PRESSURE_ADVANCE" with ADVANCE -> "0.03".
struct Command {
  std::string name;
  std::map<std::string, std::string> parameters;

  [[nodiscard]] std::optional<double> Number(const std::string& key) const {
    const auto found = parameters.find(key);
    if (found == parameters.end()) return std::nullopt;
    char* end = nullptr;
    const double value = std::strtod(found->second.c_str(), &end);
    return end == found->second.c_str() || !std::isfinite(value) ? std::nullopt
                                                                 : std::optional(value);
  }
  [[nodiscard]] std::string Text(const std::string& key) const {
    const auto found = parameters.find(key);
    return found == parameters.end() ? "" : found->second;
  }
};

Command ParseCommand(std::string_view line) {
  Command command;
  line = line.substr(0, line.find(';'));
  while (!line.empty()) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t\r"), line.size());
    line.remove_prefix(begin);
    const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
    line.remove_prefix(word.size());
    if (word.empty()) continue;
    const std::size_t equals = word.find('=');
    if (command.name.empty()) {
      command.name = UpperCase(word);
    } else if (equals != std::string_view::npos) {
      command.parameters[UpperCase(word.substr(0, equals))] = word.substr(equals + 1);
    } else {
      command.parameters[UpperCase(word.substr(0, 1))] = word.substr(1);
    }
  }
  return command;
}

/// Parses G-code and records the settings that it changes.
class Finder {
 public:
  explicit Finder(const PrinterState& now) : now_(now), extruder_(now.active_extruder) {}

  void Read(const Command& command) {
    const std::string& name = command.name;
    if (name == "G90" || name == "G91") Note("absolute_coordinates", name == "G90" ? 1.0 : 0.0);
    if (name == "M82" || name == "M83") Note("absolute_extrude", name == "M82" ? 1.0 : 0.0);
    if (name == "M220") Note("speed_factor", Percent(command));
    if (name == "M221") Note("extrude_factor", Percent(command));
    if (name == "M204") NoteAcceleration(command);
    if (name == "SET_VELOCITY_LIMIT") NoteParameters(command, "");
    if (name == "SET_PRESSURE_ADVANCE") NoteParameters(command, Motor(command.Text("EXTRUDER")));
    if (name == "SET_HEATER_TEMPERATURE") NoteTarget(Heater(command.Text("HEATER")), command);
    if (name == "M140" || name == "M190") Note("target heater_bed", command.Number("S"));
    if (name == "M104" || name == "M109") Note("target " + Nozzle(command), command.Number("S"));
    if (name == "ACTIVATE_EXTRUDER") extruder_ = command.Text("EXTRUDER");
    if (name.size() > 1 && name[0] == 'T' && std::isdigit(static_cast<unsigned char>(name[1]))) {
      extruder_ = Extruder(name.substr(1));
    }
  }

  [[nodiscard]] std::map<std::string, std::set<double>> Take() { return std::move(given_); }

 private:
  void Note(const std::string& name, std::optional<double> value) {
    if (value) given_[name].insert(*value);
  }

  void NoteParameters(const Command& command, const std::string& section) {
    for (const Kind& kind : kKinds) {
      const bool of_a_section = kind.parameter == "ADVANCE" || kind.parameter == "SMOOTH_TIME";
      if (kind.parameter.empty() || kind.name == "target" || of_a_section == section.empty()) {
        continue;
      }
      Note(std::string(kind.name) + (section.empty() ? "" : " " + section),
           command.Number(std::string(kind.parameter)));
    }
  }

  // Reads it like Klipper: S, else the lower of P and T.
  void NoteAcceleration(const Command& command) {
    const auto s = command.Number("S"), p = command.Number("P"), t = command.Number("T");
    Note("max_accel", s ? s : p && t ? std::optional(std::min(*p, *t)) : std::nullopt);
  }

  void NoteTarget(const std::string& heater, const Command& command) {
    Note("target " + heater, command.Number("TARGET").value_or(0));
  }

  static double Percent(const Command& command) { return command.Number("S").value_or(100) / 100; }

  static std::string Extruder(const std::string& number) {
    return number == "0" ? "extruder" : "extruder" + number;
  }

  [[nodiscard]] std::string Nozzle(const Command& command) const {
    const auto tool = command.Number("T");
    return tool ? Extruder(fmt::format("{:.0f}", *tool)) : extruder_;
  }

  // Returns the section with this G-code name.
  [[nodiscard]] std::string Motor(const std::string& name) const {
    for (const auto& [section, motor] : now_.pressure_advance) {
      if (machine::NameInGcode(section) == name) return section;
    }
    return name.empty() ? extruder_ : name;
  }
  [[nodiscard]] std::string Heater(const std::string& name) const {
    for (const auto& [section, heater] : now_.heaters) {
      if (machine::NameInGcode(section) == name) return section;
    }
    return name;
  }

  const PrinterState& now_;
  std::string extruder_;
  std::map<std::string, std::set<double>> given_;
};

}  // namespace

SettingValues SettingsOf(const PrinterState& state) {
  SettingValues values;
  const machine::VelocityLimits& limits = state.limits;
  if (limits.max_velocity_mm_s > 0) {
    values["max_velocity"] = limits.max_velocity_mm_s;
    values["max_accel"] = limits.max_accel_mm_s2;
    values["square_corner_velocity"] = limits.square_corner_velocity_mm_s;
    if (limits.minimum_cruise_ratio) values["minimum_cruise_ratio"] = *limits.minimum_cruise_ratio;
  }
  for (const auto& [section, motor] : state.pressure_advance) {
    values["pressure_advance " + section] = motor.advance_s;
    if (motor.smooth_time_s) values["smooth_time " + section] = *motor.smooth_time_s;
  }
  for (const auto& [name, heater] : state.heaters) values["target " + name] = heater.target_c;
  const machine::GcodeModes& gcode = state.gcode;
  values["absolute_coordinates"] = gcode.absolute_coordinates ? 1 : 0;
  values["absolute_extrude"] = gcode.absolute_extrude ? 1 : 0;
  values["speed_factor"] = gcode.speed_factor;
  values["extrude_factor"] = gcode.extrude_factor;
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    values[std::string("offset ") + kAxes[axis]] = gcode.homing_origin_mm[axis];
  }
  return values;
}

std::map<std::string, std::set<double>> SettingsIn(std::string_view gcode,
                                                   const PrinterState& now) {
  Finder finder(now);
  while (!gcode.empty()) {
    const std::size_t end = std::min(gcode.find('\n'), gcode.size());
    finder.Read(ParseCommand(gcode.substr(0, end)));
    gcode.remove_prefix(std::min(end + 1, gcode.size()));
  }
  return finder.Take();
}

bool SameValue(double a, double b) {
  constexpr double kShare = 1e-6;
  return std::abs(a - b) <= kShare * std::max(1.0, std::abs(a));
}

bool GaveIt(const files::RunJournal& journal, const std::string& name, double value) {
  const auto given = journal.given.find(name);
  return given != journal.given.end() &&
         std::any_of(given->second.begin(), given->second.end(),
                     [&](double one) { return SameValue(one, value); });
}

std::vector<std::string> SettingLines(const SettingValues& values) {
  std::vector<std::pair<std::string, std::string>> lines;  // a command, and its parameters
  for (const auto& [name, value] : values) {
    const Split split = SplitName(name);
    const Kind* kind = KindOf(split.kind);
    if (kind == nullptr) continue;
    if (kind->parameter.empty()) {
      if (const std::string line = ModeLine(split.kind, value); !line.empty()) {
        lines.emplace_back(line, "");
      }
      continue;
    }
    const std::string command = CommandOf(split);
    auto line = std::find_if(lines.begin(), lines.end(),
                             [&](const auto& other) { return other.first == command; });
    if (line == lines.end()) line = lines.insert(lines.end(), {command, ""});
    line->second += fmt::format(" {}={}", kind->parameter, value);
  }
  const auto accel = values.find("max_accel"), cruise = values.find("minimum_cruise_ratio");
  if (accel != values.end() && cruise != values.end()) {
    // Equivalent of the ratio for a Klipper before 2024; later ones ignore it beside that.
    for (auto& [command, parameters] : lines) {
      if (command != "SET_VELOCITY_LIMIT") continue;
      parameters += fmt::format(" ACCEL_TO_DECEL={}", accel->second * (1 - cruise->second));
    }
  }
  std::vector<std::string> whole;
  for (const auto& [command, parameters] : lines) whole.push_back(command + parameters);
  return whole;
}

std::string DescribeSetting(const std::string& name, double value) {
  const Split split = SplitName(name);
  const Kind* kind = KindOf(split.kind);
  if (kind == nullptr) return fmt::format("{} {:.4g}", name, value);
  return fmt::format("{}{} {:.4g}{}", kind->words, split.section, value, kind->unit);
}

std::vector<std::string> Differences(const SettingValues& before, const SettingValues& now) {
  std::vector<std::string> parts;
  for (const auto& [name, is] : now) {
    if (IsOfGcodeState(name)) continue;
    const auto found = before.find(name);
    const double was = found == before.end() ? 0 : found->second;
    if (!SameValue(was, is)) {
      parts.push_back(fmt::format("{} (was {:.4g})", DescribeSetting(name, is), was));
    }
  }
  return parts;
}

bool IsOfGcodeState(const std::string& name) {
  const Kind* kind = KindOf(SplitName(name).kind);
  return kind != nullptr && kind->parameter.empty();
}

bool IsTarget(const std::string& name) { return name.starts_with("target "); }

std::string TargetLine(const std::string& heater, double target_c) {
  return SettingLines({{"target " + heater, target_c}}).front();
}

std::string HeatersOn(const PrinterState& state) {
  std::vector<std::string> on;
  for (const auto& [name, heater] : state.heaters) {
    if (heater.target_c > 0) on.push_back(fmt::format("{} {:.0f} degC", name, heater.target_c));
  }
  return Joined(on);
}

std::string Joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + part;
  return text;
}

}  // namespace trammel::procedure

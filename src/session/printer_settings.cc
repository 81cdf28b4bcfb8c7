#include "session/printer_settings.h"

#include <fmt/format.h>

#include <initializer_list>
#include <optional>
#include <utility>

namespace trammel::procedure {

using files::RunJournal;

RunJournal JournalOf(const machine::PrinterState& state) {
  RunJournal journal;
  const machine::VelocityLimits& limits = state.limits;
  if (limits.max_velocity_mm_s > 0) {
    journal.max_velocity_mm_s = limits.max_velocity_mm_s;
    journal.max_accel_mm_s2 = limits.max_accel_mm_s2;
    journal.square_corner_velocity_mm_s = limits.square_corner_velocity_mm_s;
    journal.minimum_cruise_ratio = limits.minimum_cruise_ratio;
  }
  journal.pressure_advance = state.pressure_advance;
  for (const auto& [name, heater] : state.heaters) journal.targets_c[name] = heater.target_c;
  return journal;
}

std::vector<std::string> SettingLines(const RunJournal& before) {
  std::vector<std::string> lines;
  const auto add =
      [&lines](const char* command,
               std::initializer_list<std::pair<const char*, std::optional<double>>> parameters) {
        std::string line = command;
        for (const auto& [key, value] : parameters) {
          if (value) line += fmt::format(" {}={}", key, *value);
        }
        if (line != command) lines.push_back(std::move(line));
      };
  add("SET_VELOCITY_LIMIT", {{"VELOCITY", before.max_velocity_mm_s},
                             {"ACCEL", before.max_accel_mm_s2},
                             {"SQUARE_CORNER_VELOCITY", before.square_corner_velocity_mm_s},
                             {"MINIMUM_CRUISE_RATIO", before.minimum_cruise_ratio}});
  for (const auto& [section, motor] : before.pressure_advance) {
    const std::string command = "SET_PRESSURE_ADVANCE EXTRUDER=" + machine::NameInGcode(section);
    add(command.c_str(), {{"ADVANCE", motor.advance_s}, {"SMOOTH_TIME", motor.smooth_time_s}});
  }
  return lines;
}

std::string DescribeSettings(const RunJournal& before) {
  std::string text;
  for (const auto& [section, motor] : before.pressure_advance) {
    text += fmt::format("{}pressure advance {:.4g} s{}", text.empty() ? "" : ", ", motor.advance_s,
                        before.pressure_advance.size() == 1 ? "" : " of " + section);
  }
  if (before.max_velocity_mm_s && before.max_accel_mm_s2) {
    text += fmt::format("{}limits {:.4g} mm/s and {:.4g} mm/s2", text.empty() ? "" : ", ",
                        *before.max_velocity_mm_s, *before.max_accel_mm_s2);
  }
  return text.empty() ? "its G-code state" : text;
}

std::string TargetLine(const std::string& heater, double target_c) {
  return fmt::format("SET_HEATER_TEMPERATURE HEATER={} TARGET={}", machine::NameInGcode(heater),
                     target_c);
}

std::string HeatersOn(const machine::PrinterState& state) {
  std::string text;
  for (const auto& [name, heater] : state.heaters) {
    if (heater.target_c > 0) {
      text += fmt::format("{}{} {:.0f} degC", text.empty() ? "" : ", ", name, heater.target_c);
    }
  }
  return text;
}

}  // namespace trammel::procedure

// Printer settings that G-code changes: read from its status, found in G-code, converted to G-code
// and text.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "machine/moonraker/printer.h"
#include "session/run_journal.h"

namespace trammel::procedure {

/// Returns all settings as they are now.
[[nodiscard]] files::SettingValues SettingsOf(const machine::PrinterState& state);

/// Returns every value that plain commands in a G-code text set; the effect of macros is unknown.
/// @param now  names the sections, and the extruder that is active at the beginning
[[nodiscard]] std::map<std::string, std::set<double>> SettingsIn(std::string_view gcode,
                                                                 const machine::PrinterState& now);

/// True if two values of a setting are equal, but for rounding in the status.
[[nodiscard]] bool SameValue(double a, double b);

/// True if a run set this value, by its journal.
[[nodiscard]] bool GaveIt(const files::RunJournal& journal, const std::string& name, double value);

/// Returns the commands that set these values: one for limits, one for each motor, one for each
/// heater. Never includes G-code's offset.
[[nodiscard]] std::vector<std::string> SettingLines(const files::SettingValues& values);

/// "pressure advance of extruder 0.031 s"
[[nodiscard]] std::string DescribeSetting(const std::string& name, double value);

/// "pressure advance of extruder 0.06 s (was 0.031)" for each limit, pressure advance and target
/// that is not as it was.
[[nodiscard]] std::vector<std::string> Differences(const files::SettingValues& before,
                                                   const files::SettingValues& now);

/// True if it is a mode or an offset of the G-code interpreter, which SAVE_GCODE_STATE saves.
[[nodiscard]] bool IsOfGcodeState(const std::string& name);

/// True if the setting is a heater's target.
[[nodiscard]] bool IsTarget(const std::string& name);

/// Returns SET_HEATER_TEMPERATURE for a heater by its status name.
[[nodiscard]] std::string TargetLine(const std::string& heater, double target_c);

/// "extruder 205 degC, heater_bed 60 degC": the heaters that are on.
[[nodiscard]] std::string HeatersOn(const machine::PrinterState& state);

/// "a, b, c"
[[nodiscard]] std::string Joined(const std::vector<std::string>& parts);

}  // namespace trammel::procedure

// Reads the settings that a run has to bring back from a printer's status, and turns them into
// G-code and words.
#pragma once

#include <string>
#include <vector>

#include "machine/moonraker/printer_state.h"
#include "session/run_journal.h"

namespace trammel::procedure {

/// How the printer is now, to be brought back later.
[[nodiscard]] files::RunJournal JournalOf(const machine::PrinterState& state);

/// The commands that set limits and pressure advance as they were.
[[nodiscard]] std::vector<std::string> SettingLines(const files::RunJournal& before);

/// "pressure advance 0.031 s, limits 300 mm/s and 5000 mm/s2": the same for people.
[[nodiscard]] std::string DescribeSettings(const files::RunJournal& before);

/// SET_HEATER_TEMPERATURE for a heater as the status names it.
[[nodiscard]] std::string TargetLine(const std::string& heater, double target_c);

/// "extruder 205 degC, heater_bed 60 degC": the heaters that are on.
[[nodiscard]] std::string HeatersOn(const machine::PrinterState& state);

}  // namespace trammel::procedure

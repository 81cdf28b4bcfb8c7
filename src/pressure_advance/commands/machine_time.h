// How long a calibration keeps the machine, part by part, before anything moves.
#pragma once

#include <optional>
#include <string>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "settings/scan_settings.h"

namespace trammel::app {

/// All without heating, cooling, homing and what commands take on their way.
struct MachineTime {
  pressure_advance::PatternTime print;
  std::optional<procedure::ScanTime> scan;  ///< absent where the head cannot reach the lines

  [[nodiscard]] double total_s() const { return print.total_s() + (scan ? scan->total_s() : 0); }
};

/// What the head reaches on the bed of the settings.
[[nodiscard]] procedure::Reach BedOf(const pressure_advance::PatternConfig& pattern);

/// Of a pattern that is scanned right after it was printed. REQUIRES a valid pattern.
[[nodiscard]] MachineTime MachineTimeOf(const pressure_advance::PatternConfig& pattern,
                                        const settings::ScanSettings& settings);

/// One line each: "57 s: lines 32.2, frame 9.1, ..."
[[nodiscard]] std::string Describe(const pressure_advance::PatternTime& time);
[[nodiscard]] std::string Describe(const procedure::ScanTime& time);

}  // namespace trammel::app

// What must be right before a machine moves, each with what to do about it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/pattern_config.h"
#include "pressure_advance/pattern_plan.h"
#include "pressure_advance/scan_settings.h"
#include "procedure/session.h"
#include "procedure/sweep_plan.h"

namespace trammel::procedure {

struct Check {
  std::string name;  ///< what was looked at
  bool passed = false;
  std::string detail;    ///< what was found; where not passed, also what to do
  bool advice = false;   ///< a calibration can do without it
  bool stopped = false;  ///< the user's stop came before anything was found
};

/// A check that could not be made.
[[nodiscard]] Check NotMade(std::string name, const Error& error);

/// Ready, idle, with the commands that the settings name, and a bed that holds pattern and scan.
/// Moves nothing, changes nothing. Never fails by itself: what cannot be asked is a check not
/// passed.
/// @param plan  where the lines lie, where `pattern` does not say it.
[[nodiscard]] std::vector<Check> CheckPrinter(
    const Session& session, const pressure_advance::PatternConfig& pattern,
    const pressure_advance::ScanSettings& settings,
    const std::optional<pressure_advance::PatternPlan>& plan = {});

/// That the printer can heat to what the pattern asks for: no less than its extruder needs to push
/// filament, and no more than nozzle and bed may have. Without a material it is advice.
[[nodiscard]] Check CheckTemperatures(const Session& session,
                                      const pressure_advance::PatternConfig& pattern);

/// Whether the folder's disk has room for a recording of the given length.
[[nodiscard]] Check CheckDisk(const std::filesystem::path& folder, double record_s,
                              double frames_per_s);

/// What a first scan would find out late: that the printer's clock and its motion can be followed.
/// Asks for some seconds.
[[nodiscard]] std::vector<Check> CheckTiming(const Session& session);

/// The first check that was not passed, but for advice, as an error. Busy and unready printers are
/// kMachine, what is outside the bed kSafety, what the user's stop kept from being looked at
/// kInterrupted.
[[nodiscard]] Result<void> FirstFailure(const std::vector<Check>& checks, ErrorKind kind);

/// What the head can reach, from the printer's own limits.
[[nodiscard]] Reach ReachOf(const machine::PrinterState& state);

}  // namespace trammel::procedure

// Checks before a pattern is printed and scanned, each with its remedy.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "session/checks.h"
#include "session/print_needs.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Pattern that is to be printed, or is on the plate.
struct CheckedPattern {
  const pressure_advance::PatternConfig& pattern;
  /// Plan of an already printed pattern: positions and print settings of the lines.
  std::optional<pressure_advance::PatternPlan> plan = {};
  bool prints = true;  ///< false: it lies there
};

/// Returns the requirements of the print on the printer.
[[nodiscard]] PrintNeeds NeedsOf(const CheckedPattern& checked);

/// Checks that the printer is ready, idle, has the commands that the settings name, states nothing
/// against the pattern, and has a bed that fits pattern and scan. Moves and changes nothing. Never
/// fails itself: a failed query is a check not passed.
[[nodiscard]] std::vector<Check> CheckPrinter(const Session& session, const CheckedPattern& checked,
                                              const settings::ScanSettings& settings);

/// Does the same without position and pattern: ready, idle, and with the commands that the settings
/// name.
[[nodiscard]] std::vector<Check> CheckLaserCommands(const Session& session,
                                                    const pressure_advance::PatternConfig& pattern,
                                                    const settings::ScanSettings& settings);

/// Checks a print alone: ready, idle, with the commands of the start and end G-code, no report
/// against the pattern, and a sufficient bed.
[[nodiscard]] std::vector<Check> CheckForPrint(const Session& session,
                                               const CheckedPattern& checked);

/// Returns the reach of the head, from the printer's own limits and kinematics.
[[nodiscard]] Result<Reach> ReachOf(const Session& session);

}  // namespace trammel::procedure

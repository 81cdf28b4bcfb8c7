// What must be right before a pattern is printed and scanned, each with what to do about it.
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

/// A pattern that is printed, or lies on the plate.
struct CheckedPattern {
  const pressure_advance::PatternConfig& pattern;
  /// Of a pattern that lies there: where the lines lie and how they were printed.
  std::optional<pressure_advance::PatternPlan> plan = {};
  bool prints = true;  ///< false: it lies there
};

/// What printing it takes for granted of the printer.
[[nodiscard]] PrintNeeds NeedsOf(const CheckedPattern& checked);

/// Ready, idle, with the commands that the settings name, a printer that states nothing against the
/// pattern, and a bed that holds pattern and scan. Moves nothing, changes nothing. Never fails by
/// itself: what cannot be asked is a check not passed.
[[nodiscard]] std::vector<Check> CheckPrinter(const Session& session, const CheckedPattern& checked,
                                              const settings::ScanSettings& settings);

/// The same without any place and any pattern: ready, idle, and with the commands that the settings
/// name.
[[nodiscard]] std::vector<Check> CheckLaserCommands(const Session& session,
                                                    const pressure_advance::PatternConfig& pattern,
                                                    const settings::ScanSettings& settings);

/// What a print alone needs: ready, idle, with the commands of the start and end G-code, a printer
/// that states nothing against the pattern, and a bed that holds it.
[[nodiscard]] std::vector<Check> CheckForPrint(const Session& session,
                                               const CheckedPattern& checked);

/// What the head can reach, from the printer's own limits and kinematics.
[[nodiscard]] Result<Reach> ReachOf(const Session& session);

}  // namespace trammel::procedure

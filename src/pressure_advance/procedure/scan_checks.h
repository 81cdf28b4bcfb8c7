// What must be right before a pattern is printed and scanned, each with what to do about it.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "session/checks.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Ready, idle, with the commands that the settings name, and a bed that holds pattern and scan.
/// Moves nothing, changes nothing. Never fails by itself: what cannot be asked is a check not
/// passed.
/// @param plan  where the lines lie, where `pattern` does not say it.
[[nodiscard]] std::vector<Check> CheckPrinter(
    const Session& session, const pressure_advance::PatternConfig& pattern,
    const settings::ScanSettings& settings,
    const std::optional<pressure_advance::PatternPlan>& plan = {});

/// The same without any place: ready, idle, and with the commands that the settings name.
[[nodiscard]] std::vector<Check> CheckLaserCommands(const Session& session,
                                                    const pressure_advance::PatternConfig& pattern,
                                                    const settings::ScanSettings& settings);

/// What a print alone needs: ready, idle, with the commands of the start and end G-code, and a bed
/// that holds the pattern.
[[nodiscard]] std::vector<Check> CheckForPrint(const Session& session,
                                               const pressure_advance::PatternConfig& pattern);

/// What the head can reach, from the printer's own limits.
[[nodiscard]] Reach ReachOf(const machine::PrinterState& state);

}  // namespace trammel::procedure

// One plate with a pattern for each fast speed and acceleration: what trammel pa table says of
// them, in one heating.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "app/config/config_file.h"
#include "base/result.h"
#include "pressure_advance/flow/flow_table.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "session/session.h"

namespace trammel::app {

/// What the command line asks for. Empty lists: the settings' own.
struct AskedConditions {
  std::vector<double> speeds_mm_s;
  std::vector<double> accelerations_mm_s2;
  std::optional<double> max_flow_mm3_s;  ///< that the hot end melts

  [[nodiscard]] bool any() const { return !speeds_mm_s.empty() || !accelerations_mm_s2.empty(); }
};

/// Each speed with each acceleration, in the order of accelerations. Errors (kInput): fewer than 2
/// combinations or more than a plate may have; one named twice; a speed that is not above the slow
/// ones; numbers that are none; kSafety where more flow is asked for than the hot end melts.
[[nodiscard]] Result<std::vector<pressure_advance::PatternConditions>> CombineConditions(
    const AskedConditions& asked, const pressure_advance::PatternConfig& pattern);

/// Lays a pattern for each of the conditions on the plate. Errors: those of PatternsBeside and
/// Validate; those of PlanSweeps for a single pattern.
[[nodiscard]] Result<pressure_advance::PatternConfig> LayConditions(
    const std::vector<pressure_advance::PatternConditions>& conditions, const files::Config& config,
    const procedure::Reach& reach);

struct ConditionsRun {
  files::Config config;  ///< its pattern as LayConditions() lays it
  std::string out;       ///< new folder for all of them; empty: as NewFolder
  std::string filament;
  bool json = false;
  bool keep_full = false;
};

/// Prints all patterns, scans each into a recording of its own, says what each gives and the table
/// of them. @returns the exit code: good where every pattern gives an answer.
[[nodiscard]] Result<int> RunConditions(const ConditionsRun& run,
                                        const procedure::Session& session);

// Pressure advance over flow and acceleration, from the recordings of several calibrations.

/// The table of what recordings keep as their answers, by the flows and accelerations of their
/// plans. Errors: a folder without either, or without a good answer; one named twice; another
/// filament, nozzle or printer than the others'.
[[nodiscard]] Result<pressure_advance::FlowTable> TableOf(
    const std::vector<std::string>& recordings);

/// As `pa table --json` has it (docs/reference/formats.md).
[[nodiscard]] nlohmann::ordered_json TableJson(const pressure_advance::FlowTable& table);

/// As text on standard output.
/// @param filament_diameter_mm  > 0; firmware counts flow in mm of filament
void PrintTable(const pressure_advance::FlowTable& table, double filament_diameter_mm);

}  // namespace trammel::app

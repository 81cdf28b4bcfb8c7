// One plate with a pattern for each fast speed and acceleration: the conditions that trammel pa
// table lists, in one heating.
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

/// Conditions from the command line. Empty lists: the settings' own.
struct AskedConditions {
  std::vector<double> speeds_mm_s;
  std::vector<double> accelerations_mm_s2;
  std::optional<double> max_flow_mm3_s;  ///< limit of the hot end

  [[nodiscard]] bool any() const { return !speeds_mm_s.empty() || !accelerations_mm_s2.empty(); }
};

/// Combines each speed with each acceleration, in the order of accelerations. Errors (kInput):
/// fewer than 2 combinations or more than a plate may have; a duplicate; a speed that is not above
/// the slow ones; invalid numbers; kSafety if more flow is requested than the hot end melts.
[[nodiscard]] Result<std::vector<pressure_advance::PatternConditions>> CombineConditions(
    const AskedConditions& asked, const pressure_advance::PatternConfig& pattern);

/// Arranges a pattern for each of the conditions on the plate. Errors: those of PatternsBeside and
/// Validate; those of PlanSweeps for a single pattern.
[[nodiscard]] Result<pressure_advance::PatternConfig> LayConditions(
    const std::vector<pressure_advance::PatternConditions>& conditions, const files::Config& config,
    const procedure::Reach& reach);

struct ConditionsRun {
  files::Config config;  ///< pattern laid out by LayConditions()
  std::string out;       ///< new folder for all of them; empty: as NewFolder
  std::string filament;
  bool json = false;
  bool keep_full = false;
};

/// Prints all patterns, scans each into its own recording, and prints each result and a table of
/// them. @returns the exit code: good if every pattern yields an answer.
[[nodiscard]] Result<int> RunConditions(const ConditionsRun& run,
                                        const procedure::Session& session);

// Table of pressure advance over flow and acceleration, from the recordings of several
// calibrations.

/// Returns the table of the recordings' stored answers, by the flows, accelerations and layer
/// heights of their plans. Errors: a folder without either, or without a good answer; a duplicate;
/// a filament, nozzle or printer other than the others'; no recording of the layer height.
/// @param layer_height_mm  leaves out all others; absent: all
[[nodiscard]] Result<pressure_advance::FlowTable> TableOf(
    const std::vector<std::string>& recordings, std::optional<double> layer_height_mm = {});

/// Returns the JSON of `pa table --json` (docs/reference/formats.md).
[[nodiscard]] nlohmann::ordered_json TableJson(const pressure_advance::FlowTable& table);

/// Prints the table as text.
/// @param filament_diameter_mm  > 0; firmware counts flow in mm of filament
void PrintTable(const pressure_advance::FlowTable& table, double filament_diameter_mm);

}  // namespace trammel::app

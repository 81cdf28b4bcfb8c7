// Sets up laser and camera on a real printer: the stripe over heights, a printed mark from known
// positions, and a trial of the offset.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/setup_route.h"
#include "pressure_advance/setup/printed_mark.h"
#include "pressure_advance/setup/solve_setup.h"
#include "session/guarded_steps.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

struct SetupRequest {
  pressure_advance::PatternConfig pattern;
  settings::ScanSettings settings;  ///< expected camera offset and focus height
  pressure_advance::MarkPlace mark;
  ClearHeights clear;
  std::filesystem::path folder;  ///< is there and empty; receives pictures and G-code
  RunIdentity identity;          ///< its run, started and state_folder are asked for
};

/// Observations and results of a setup.
struct SetupRecord {
  pressure_advance::MarkPlan mark;
  std::vector<pressure_advance::PlacedStripe> first_sweep;  ///< over the empty plate
  pressure_advance::SetupObservations seen;
  pressure_advance::SetupResult result;
  std::string camera;  ///< camera's description of itself
};

/// Good: the record has a verdict, good or not. Else the machine failed, or the run was stopped.
struct SetupOutcome : GuardedOutcome {
  SetupRecord record;
};

/// Sweeps the laser over heights of the empty plate for the focus, prints the mark, sweeps again
/// beside it, looks at the mark from sixteen places, solves, and brings the mark to the laser as a
/// trial. Moves nothing before commands, heights, places, temperatures and the room on the disk
/// were checked. Ends before it prints where the first sweep finds no focus. Laser, lights,
/// settings and heaters come back whatever happens (RunGuarded).
[[nodiscard]] SetupOutcome SetUpCamera(const Session& session, const SetupRequest& request);

}  // namespace trammel::procedure

// Sets up laser and camera on a real printer: the stripe over heights, a printed mark from known
// places, and the offset tried.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/setup_route.h"
#include "pressure_advance/setup/printed_mark.h"
#include "pressure_advance/setup/solve_setup.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

struct SetupRequest {
  pressure_advance::PatternConfig pattern;
  settings::ScanSettings settings;  ///< where the camera is expected: offset and focus height
  pressure_advance::MarkPlace mark;
  ClearHeights clear;
  pressure_advance::SetupLimits limits;
  std::filesystem::path folder;        ///< is there and empty; receives pictures and G-code
  std::string started;                 ///< date and time, for people
  std::string run;                     ///< unique; as files::IsRunName wants it
  std::filesystem::path state_folder;  ///< of journals and locks; empty: files::StateFolder()
};

/// What was seen, and what came of it.
struct SetupRecord {
  pressure_advance::MarkPlan mark;
  std::vector<pressure_advance::PlacedStripe> first_sweep;  ///< over the empty plate
  pressure_advance::SetupObservations seen;
  pressure_advance::SetupResult result;
  std::string camera;  ///< as the camera describes itself
};

struct SetupOutcome {
  /// Good: the record holds a verdict, which need not be good. Else the machine failed, or it was
  /// stopped.
  Result<void> done;
  std::vector<std::string> unrestored;  ///< what could not be brought back to how it was
  SetupRecord record;
};

/// That the printer can do what the request asks for: commands, heights, places, temperatures, room
/// on the disk. Moves nothing. Errors: kInput, kSafety, kMachine; each with what to do.
[[nodiscard]] Result<void> CheckSetup(const Session& session, const SetupRequest& request);

/// Sweeps the laser over heights of the empty plate for the focus, prints the mark, sweeps again
/// beside it, looks at the mark from sixteen places, solves, and brings the mark to the laser as a
/// trial. Ends before it prints where the first sweep finds no focus. Laser, lights, settings and
/// heaters come back whatever happens (RunGuarded).
[[nodiscard]] SetupOutcome SetUpCamera(const Session& session, const SetupRequest& request);

}  // namespace trammel::procedure

// Runs steps with exclusive use of a printer: the checks before, and the restoration after.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "session/printer_state_guard.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

struct GuardedSteps {
  const settings::ScanSettings* settings = nullptr;  ///< REQUIRED; not owned
  RunIdentity identity;  ///< a state folder that is empty: files::StateFolder(). Its address is
                         ///< that of the settings
  ParkPlace park;        ///< of the nozzle of a print that was not finished
  /// Moves nothing; an error ends the run before any change.
  std::function<Result<void>(const Session&)> check;
  std::function<Result<void>(const Session&, PrinterStateGuard&)> steps;
};

struct GuardedOutcome {
  Result<void> done;
  std::vector<std::string> unrestored;  ///< states that could not be restored
};

/// Ends a dead run's print, runs the checks, claims the printer, runs the steps. In any case
/// everything in PrinterStateGuard's scope is restored. An error names a stop, or a restart, that
/// caused it.
/// @param session  receives the run's name at the printer (PrinterStateGuard::Take).
[[nodiscard]] GuardedOutcome RunGuarded(Session& session, const GuardedSteps& run);

/// Homes unhomed axes, if no other job has the printer. Errors: the printer's.
[[nodiscard]] Result<void> HomeWhereItIsNot(const Session& session);

// Switches a laser off by any means necessary.

/// Describes a printer that has shut down: state of laser and heaters, and the remedy.
[[nodiscard]] std::string DescribeShutdown(const machine::PrinterState& now);

/// Runs the command that switches the laser off. If that fails and the laser may be on, the printer
/// is stopped instead, and another's job that this ends is named. If this run never lit the laser,
/// the failure is only reported. A printer that is unreachable or has shut down is not stopped.
/// Ignores the session's stop.
/// @param lit  true if the session may have switched the laser on.
/// @returns one sentence for each problem that a person must solve; empty: none.
[[nodiscard]] std::vector<std::string> SwitchLaserOff(const Session& session,
                                                      const std::string& laser_off_gcode, bool lit);

}  // namespace trammel::procedure

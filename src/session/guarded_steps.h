// Runs steps on a printer that they have to themselves: the checks before, what is brought back
// after.
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
  /// Moves nothing; an error ends the run before anything was changed.
  std::function<Result<void>(const Session&)> check;
  std::function<Result<void>(const Session&, PrinterStateGuard&)> steps;
};

struct GuardedOutcome {
  Result<void> done;
  std::vector<std::string> unrestored;  ///< what could not be brought back to how it was
};

/// Ends what a dead run still prints, checks, takes the printer, runs the steps. Whatever happens,
/// everything comes back that PrinterStateGuard brings back. An error names a stop, or a restart,
/// that was its cause.
/// @param session  receives what the run is called at the printer (PrinterStateGuard::Take).
[[nodiscard]] GuardedOutcome RunGuarded(Session& session, const GuardedSteps& run);

/// Homes where an axis is not, where nobody else has the printer. Errors: the printer's.
[[nodiscard]] Result<void> HomeWhereItIsNot(const Session& session);

// Switches a laser off, whatever it takes.

/// Describes a printer that has shut down: what holds for laser and heaters, and the remedy.
[[nodiscard]] std::string DescribeShutdown(const machine::PrinterState& now);

/// Runs the command that switches the laser off. Where that fails and the laser may be on, the
/// printer is stopped instead, and somebody else's job that ends by it is named; where this run
/// never lit the laser, the failure is only told. A printer that is away or has shut down is not
/// stopped. Ignores the session's stop.
/// @param lit  whether the session may have switched the laser on.
/// @returns one sentence for each thing that a person has to see to; empty: go on.
[[nodiscard]] std::vector<std::string> SwitchLaserOff(const Session& session,
                                                      const std::string& laser_off_gcode, bool lit);

}  // namespace trammel::procedure

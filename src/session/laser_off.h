// Switches a laser off, whatever it takes.
#pragma once

#include <string>
#include <vector>

#include "machine/moonraker/printer.h"
#include "session/session.h"

namespace trammel::procedure {

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

// The nozzle before a scan: it must not ooze over the pattern.
#pragma once

#include "base/result.h"
#include "session/session.h"

namespace trammel::procedure {

/// Cools the active extruder to a temperature and waits for it; one that is colder already stays
/// as it is. 0: switches it off and waits for nothing.
[[nodiscard]] Result<void> CoolForScan(const Session& session, const machine::PrinterState& state,
                                       double nozzle_c, double time_limit_s);

}  // namespace trammel::procedure

// Ends a run's own print that was not finished, and gets the nozzle out of the plastic.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "machine/moonraker/printer.h"
#include "session/session.h"

namespace trammel::procedure {

/// Where the nozzle of a print that was not finished goes: up first, then there.
struct ParkPlace {
  double lift_mm = 0;  ///< above where it stands, as far as the axis goes
  double x_mm = 0;     ///< the printer's own coordinates
  double y_mm = 0;
  double z_speed_mm_s = 5;
  double travel_speed_mm_s = 150;
};

/// One sentence for each thing that did not succeed.
struct EndedPrint {
  std::vector<std::string> failed;  ///< another attempt may do it
  std::vector<std::string> lost;    ///< no further attempt will
};

/// Cancels the job of the session's own file, where it is printing or paused (without
/// [pause_resume] by closing the file), and lifts and parks its nozzle, where there is a place for
/// it. A complete print and others' jobs are left alone.
/// Ignores the session's stop.
/// @param now  the printer as it was told just before.
[[nodiscard]] EndedPrint EndOwnPrint(const Session& session, const machine::PrinterState& now,
                                     const std::optional<ParkPlace>& park);

}  // namespace trammel::procedure

// Prints a G-code file on the printer and waits until it is done.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "session/session.h"

namespace trammel::procedure {

struct PrintOptions {
  double nozzle_temperature_c = 0;  ///< 0: the file heats by itself
  double bed_temperature_c = 0;
  double heat_time_limit_s = 900;                   ///< of each heater
  double print_time_s = 0;                          ///< expected, without heating
  double filament_mm = 0;                           ///< that its moves push; 0: not known
  std::function<Result<void>()> before_start = {};  ///< called when it is hot; an error ends it
};

/// Uploads the file under the session's own_file, heats, prints, and waits for the end. Heating is
/// waited for here rather than in the file, because a file that waits for heat cannot be cancelled.
/// A connection that is lost meanwhile is waited for. When stopped, or when anything else fails,
/// the print goes on: the caller's PrinterStateGuard cancels it. Errors: kMachine, also where the
/// print is paused or cancelled by somebody else, or where somebody else's job begins;
/// kInterrupted.
[[nodiscard]] Result<void> Print(const Session& session, std::string_view gcode,
                                 const PrintOptions& options);

/// What the printer does for a file: heats, or has pushed so much of its filament. Lines that were
/// read say less: those run ahead, and one of them may heat for minutes.
/// @param filament_mm  of the whole file; 0: not known, then it is the share that was read
[[nodiscard]] Progress ProgressOfPrint(const machine::PrinterState& state, double filament_mm);

/// Sets a heater's target, where the printer is free; waits for nothing. @param heater  as of
/// HeatAndWait.
[[nodiscard]] Result<void> SetTarget(const Session& session, const std::string& heater,
                                     double target_c);

/// Sets a heater's target and waits until it is within 3 degC of it (or below, where it cools).
/// Ends early where somebody else gives it another target: an idle time-out, Cooldown.
/// @param heater  "extruder", "heater_bed", …
[[nodiscard]] Result<void> HeatAndWait(const Session& session, const std::string& heater,
                                       double target_c, double time_limit_s);

/// Waits until a heater is no warmer than this; sets its target to it.
[[nodiscard]] Result<void> CoolAndWait(const Session& session, const std::string& heater,
                                       double target_c, double time_limit_s);

// Ends a run's own print that was not finished, and gets the nozzle out of the plastic.

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

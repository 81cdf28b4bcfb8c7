// Prints a G-code file on the printer and waits for its end.
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
  double heat_time_limit_s = 900;                   ///< per heater
  double print_time_s = 0;                          ///< expected, without heating
  double filament_mm = 0;                           ///< used by its moves; 0: unknown
  std::function<Result<void>()> before_start = {};  ///< called when it is hot; an error ends it
};

/// Uploads the file as the session's own_file, heats, prints, and waits for the end. Heating is
/// done here rather than in the file, because a file that waits for heat cannot be cancelled. Waits
/// for a lost connection. On a stop or any other failure the print continues: the caller's
/// PrinterStateGuard cancels it. Errors: kMachine, also if another client pauses or cancels the
/// print, or starts another job; kInterrupted.
[[nodiscard]] Result<void> Print(const Session& session, std::string_view gcode,
                                 const PrintOptions& options);

/// Returns the printer's progress in a file: heating, or fraction of filament extruded. The lines
/// read are a worse measure: they run ahead, and one of them may heat for minutes.
/// @param filament_mm  of the whole file; 0: unknown, then it is the share that was read
[[nodiscard]] Progress ProgressOfPrint(const machine::PrinterState& state, double filament_mm);

/// Sets a heater's target if the printer is free, without waiting. @param heater  as of
/// HeatAndWait.
[[nodiscard]] Result<void> SetTarget(const Session& session, const std::string& heater,
                                     double target_c);

/// Sets a heater's target and waits until it is within 3 degC of it (or below, when cooling). Ends
/// early if another source changes the target: an idle time-out, Cooldown.
/// @param heater  "extruder", "heater_bed", …
[[nodiscard]] Result<void> HeatAndWait(const Session& session, const std::string& heater,
                                       double target_c, double time_limit_s);

/// Sets a heater's target and waits until it is no warmer.
[[nodiscard]] Result<void> CoolAndWait(const Session& session, const std::string& heater,
                                       double target_c, double time_limit_s);

// Ends a run's own unfinished print, and moves the nozzle out of the plastic.

/// Nozzle's place after an unfinished print: up first, then there.
struct ParkPlace {
  double lift_mm = 0;  ///< above where it stands, as far as the axis goes
  double x_mm = 0;     ///< the printer's own coordinates
  double y_mm = 0;
  double z_speed_mm_s = 5;
  double travel_speed_mm_s = 150;
};

/// One sentence for each failure.
struct EndedPrint {
  std::vector<std::string> failed;  ///< another attempt may do it
  std::vector<std::string> lost;    ///< no further attempt will
};

/// Cancels the job of the session's own file, if it is printing or paused (without [pause_resume]
/// by closing the file), and lifts and parks its nozzle, if a position is given. A complete print
/// and others' jobs are left alone.
/// Ignores the session's stop.
/// @param now  the printer's state just before.
[[nodiscard]] EndedPrint EndOwnPrint(const Session& session, const machine::PrinterState& now,
                                     const std::optional<ParkPlace>& park);

}  // namespace trammel::procedure

// Setting a pressure advance on the printer.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "session/session.h"

namespace trammel::procedure {

// The nozzle that prints now: values are kept for it.

struct ActiveNozzle {
  std::string extruder;    ///< [a-z0-9_]+, Klipper's name of its section
  double diameter_mm = 0;  ///< of the printer's configuration
};

/// Asks the printer for its active extruder and that one's nozzle_diameter. Errors (kMachine): it
/// tells none, or a name that is no section's.
[[nodiscard]] Result<ActiveNozzle> AskActiveNozzle(const Session& session);

/// Of one motor that pushes the active extruder's filament.
struct MotorChange {
  std::string section;  ///< of printer.cfg: "extruder", "extruder_stepper belted"
  std::string command;  ///< that sets it
  std::optional<double> before_s;
  double after_s = 0;
};

struct PressureAdvanceChange {
  std::optional<double> before_s;   ///< the extruder's own; absent where the printer does not tell
  double after_s = 0;               ///< of all motors that no other value was asked for
  std::vector<MotorChange> motors;  ///< all of them, the extruder's own first
};

/// What each of several motors has, by its section: of those that the printer tells. Empty for one.
[[nodiscard]] std::map<std::string, double> BeforeEach(const PressureAdvanceChange& change);

struct ApplyOptions {
  double limit_s = 0.2;  ///< more is refused unless forced; see ApplyLimit_s
  bool force = false;
  bool dry_run = false;  ///< everything is looked at and nothing is set
  /// Motors that get another value than the rest, by their sections.
  std::map<std::string, double> own_s = {};
  /// Called with what is in force when all else is looked at; an error of it keeps it in force.
  std::function<Result<void>(const PressureAdvanceChange&)> before_setting = {};
};

/// What is applied unasked: pressure_advance_limit of the settings, or the highest value of their
/// pattern where that is more.
[[nodiscard]] double ApplyLimit_s(const pressure_advance::PatternConfig& settings);

/// Sets pressure advance on all motors of the active extruder's filament until the printer's next
/// restart, and looks whether it did.
/// Errors: kInput outside 0 … 10 s, which nothing forces; kSafety above the limit, and where the
/// printer has no pressure advance in seconds (ComparePressureAdvance); kMachine, also while the
/// printer prints or is paused, and where it reports another value afterwards.
[[nodiscard]] Result<PressureAdvanceChange> ApplyPressureAdvance(const Session& session,
                                                                 double pressure_advance_s,
                                                                 const ApplyOptions& options);

}  // namespace trammel::procedure

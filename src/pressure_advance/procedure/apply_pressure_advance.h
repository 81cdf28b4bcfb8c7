// Sets a pressure advance on the printer.
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

// Active nozzle, for which values are stored.

struct ActiveNozzle {
  std::string extruder;    ///< [a-z0-9_]+, Klipper's name of its section
  double diameter_mm = 0;  ///< from the printer's configuration
};

/// Queries the printer's active extruder and its nozzle_diameter. Errors (kMachine): it reports
/// none, or a name that is no section's.
[[nodiscard]] Result<ActiveNozzle> AskActiveNozzle(const Session& session);

/// Change of one motor that pushes the active extruder's filament.
struct MotorChange {
  std::string section;  ///< in printer.cfg: "extruder", "extruder_stepper belted"
  std::string command;  ///< that sets the value
  std::optional<double> before_s;
  double after_s = 0;
};

struct PressureAdvanceChange {
  std::optional<double> before_s;   ///< the extruder's own; absent where the printer does not tell
  double after_s = 0;               ///< for all motors without an individual value
  std::vector<MotorChange> motors;  ///< all of them, the extruder's own first
};

/// Returns the value of each of several motors, by its section, as far as reported. Empty for one.
[[nodiscard]] std::map<std::string, double> BeforeEach(const PressureAdvanceChange& change);

struct ApplyOptions {
  double limit_s = 0.2;  ///< more is refused unless forced; see ApplyLimit_s
  bool force = false;
  bool dry_run = false;  ///< everything is looked at and nothing is set
  /// Motors with a different value, by their sections.
  std::map<std::string, double> own_s = {};
  /// Called with the value in force after all other checks; on an error it remains in force.
  std::function<Result<void>(const PressureAdvanceChange&)> before_setting = {};
};

/// Returns the limit without --force: pressure_advance_limit of the settings, or their pattern's
/// highest value if that is more.
[[nodiscard]] double ApplyLimit_s(const pressure_advance::PatternConfig& settings);

/// Sets pressure advance on all motors of the active extruder's filament until the printer's next
/// restart, and verifies it.
/// Errors: kInput outside 0 … 10 s, which cannot be forced; kSafety above the limit, and if the
/// printer has no pressure advance in seconds (ComparePressureAdvance); kMachine, also while the
/// printer prints or is paused, and if it reports another value afterwards.
[[nodiscard]] Result<PressureAdvanceChange> ApplyPressureAdvance(const Session& session,
                                                                 double pressure_advance_s,
                                                                 const ApplyOptions& options);

}  // namespace trammel::procedure

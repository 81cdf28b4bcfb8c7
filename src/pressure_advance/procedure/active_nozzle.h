// The nozzle that prints now: values are kept for it.
#pragma once

#include <string>

#include "base/result.h"
#include "session/session.h"

namespace trammel::procedure {

struct ActiveNozzle {
  std::string extruder;    ///< [a-z0-9_]+, Klipper's name of its section
  double diameter_mm = 0;  ///< of the printer's configuration
};

/// Asks the printer for its active extruder and that one's nozzle_diameter. Errors (kMachine): it
/// tells none, or a name that is no section's.
[[nodiscard]] Result<ActiveNozzle> AskActiveNozzle(const Session& session);

}  // namespace trammel::procedure

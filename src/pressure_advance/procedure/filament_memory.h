// A filament's pressure advance, kept where the printer finds it at the start of a print.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "session/session.h"

namespace trammel::procedure {

/// What a filament's name is kept under. Letters become small, blanks and hyphens `_`; any other
/// character becomes `__` with the hexadecimal digits of its UTF-8, so that "PLA+" is not "PLA". A
/// key is its own key. TRAMMEL_FILAMENT of klipper/trammel.cfg does the same.
/// Errors (kInput): nothing but blanks, a control character, more than 100 bytes.
/// @returns [a-z0-9_]+: nothing else may get into Klipper's variables, where a `%` or a broken
///     literal shuts it down.
[[nodiscard]] Result<std::string> FilamentKey(std::string_view name);

/// Where a value was kept.
struct FilamentPlace {
  std::string filament;  ///< its key
  std::string nozzle;    ///< "extruder/0.40": the active extruder and its nozzle's diameter in mm
};

/// Keeps a pressure advance for a filament and the active extruder's nozzle, in `trammel_pa` of
/// Klipper's [save_variables], and looks whether it is there; what is kept for others stays.
/// @param pressure_advance_s  0 … 10 s, kept to 0.1 ms.
/// Errors: those of FilamentKey; kInput where the printer has no [save_variables], or `trammel_pa`
/// holds something else (then it stays as it is); kMachine.
[[nodiscard]] Result<FilamentPlace> KeepForFilament(const Session& session, std::string_view name,
                                                    double pressure_advance_s);

}  // namespace trammel::procedure

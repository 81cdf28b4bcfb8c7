// The filament that is loaded, as the printer or Spoolman remembers it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/spoolman.h"
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

// A filament's pressure advance, kept in Spoolman, where slicers' profiles and other printers find
// it.

/// The spool that is on the printer, as Spoolman has it; absent where none is active or the
/// printer's server knows of no Spoolman. Errors: kMachine.
[[nodiscard]] Result<std::optional<machine::Spool>> SpoolOnPrinter(const Session& session);

/// Where a value is kept, or would be.
struct SpoolPlace {
  int spool_id = 0;
  int filament_id = 0;
  std::string filament;            ///< its name
  std::string nozzle;              ///< "0.4_standard"
  std::optional<double> before_s;  ///< the filament's value until now
  std::string matrix_before;       ///< the spool's values until now, as JSON; may be empty
  bool new_fields = false;         ///< whether Spoolman lacks a field, which is added then
  bool archived = false;           ///< the spool
};

/// Looks where the value would go, and whether it can. Nothing is changed.
/// Errors: kInput where no Spoolman is known, no spool is active, a field has another type or
/// holds something that trammel does not understand; kMachine.
[[nodiscard]] Result<SpoolPlace> FindSpoolPlace(const Session& session);

/// Keeps a pressure advance on the active spool and on its filament: `pressure_advance` of the
/// filament (a number, which templates of slicers' profiles read) and
/// `pressure_advance_matrix` of the spool (a value for each nozzle; those of others stay). Fields
/// that are not there are added. Seen through within 20 s, also where somebody stops the program.
/// Errors name which of the two was kept.
/// @param place  of FindSpoolPlace, just before
/// @param pressure_advance_s  0 … 10 s, kept to 0.1 ms.
[[nodiscard]] Result<void> KeepOnSpool(const Session& session, const SpoolPlace& place,
                                       double pressure_advance_s);

}  // namespace trammel::procedure

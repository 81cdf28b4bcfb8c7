// Loaded filament, as stored by the printer or Spoolman.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/spoolman.h"
#include "session/session.h"

namespace trammel::procedure {

/// Returns the key of a filament's name. Letters become lower case, blanks and hyphens `_`; any
/// other character becomes `__` with the hexadecimal digits of its UTF-8, so that "PLA+" is not
/// "PLA". A key is its own key. TRAMMEL_FILAMENT of klipper/trammel.cfg does the same.
/// Errors (kInput): only blanks, a control character, more than 100 bytes.
/// @returns [a-z0-9_]+: nothing else may enter Klipper's variables, where a `%` or a broken literal
/// shuts it down.
[[nodiscard]] Result<std::string> FilamentKey(std::string_view name);

/// Place where a value was stored.
struct FilamentPlace {
  std::string filament;  ///< filament's key
  std::string nozzle;    ///< "extruder/0.40": the active extruder and its nozzle's diameter in mm
};

/// Stores a pressure advance for a filament and the active extruder's nozzle, in `trammel_pa` of
/// Klipper's [save_variables], and verifies it; other entries are unchanged.
/// @param pressure_advance_s  0 … 10 s, stored to 0.1 ms.
/// Errors: those of FilamentKey; kInput if the printer has no [save_variables], or `trammel_pa`
/// contains other data (then it is unchanged); kMachine.
[[nodiscard]] Result<FilamentPlace> KeepForFilament(const Session& session, std::string_view name,
                                                    double pressure_advance_s);

// Stores a filament's pressure advance in Spoolman, where slicers' profiles and other printers read
// it.

/// Returns the spool on the printer, from Spoolman; absent if none is active or the printer's
/// server has no Spoolman. Errors: kMachine.
[[nodiscard]] Result<std::optional<machine::Spool>> SpoolOnPrinter(const Session& session);

/// Place for a value, stored or not.
struct SpoolPlace {
  int spool_id = 0;
  int filament_id = 0;
  std::string filament;            ///< filament's name
  std::string nozzle;              ///< "0.4_standard"
  std::optional<double> before_s;  ///< the filament's value until now
  std::string matrix_before;       ///< the spool's values until now, as JSON; may be empty
  bool new_fields = false;         ///< true if Spoolman lacks a field, which is then added
  bool archived = false;           ///< the spool
};

/// Finds where the value would be stored, and checks that it can. Changes nothing.
/// Errors: kInput if there is no Spoolman or no active spool, a field has another type or data
/// unknown to trammel; kMachine.
[[nodiscard]] Result<SpoolPlace> FindSpoolPlace(const Session& session);

/// Stores a pressure advance on the active spool and its filament: `pressure_advance` of the
/// filament (a number, read by templates of slicers' profiles) and `pressure_advance_matrix` of the
/// spool (a value for each nozzle; other nozzles' are unchanged). Adds missing fields. Completes
/// within 20 s, even if the program is stopped. Errors name which of the two was stored.
/// @param place  of FindSpoolPlace, just before
/// @param pressure_advance_s  0 … 10 s, stored to 0.1 ms.
[[nodiscard]] Result<void> KeepOnSpool(const Session& session, const SpoolPlace& place,
                                       double pressure_advance_s);

}  // namespace trammel::procedure

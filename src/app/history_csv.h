// Results as a table for other programs.
#pragma once

#include <string>

#include "measurement/history.h"

namespace trammel::app {

/// The names of the columns, a line of CSV.
inline constexpr const char* kHistoryColumns =
    "utc,instrument,printer,nozzle,filament,name,unit,verdict,value,standard_uncertainty,"
    "interval95_lo,interval95_hi,reason,applied_utc,applied_to,program,folder,toolhead,spool,"
    "nozzle_c,bed_c\n";

/// A result as CSV, an answer a row; numbers are empty unless the verdict is good. Texts that a
/// spreadsheet would take for a formula get an apostrophe before them.
[[nodiscard]] std::string HistoryRows(const files::HistoryEntry& entry);

}  // namespace trammel::app

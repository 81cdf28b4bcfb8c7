// Results as a table for other programs.
#pragma once

#include <span>
#include <string>

#include "measurement/history.h"

namespace trammel::app {

/// As CSV, an answer a row under a line of names; numbers are empty unless the verdict
/// is good. Texts that a spreadsheet would take for a formula get an apostrophe before them.
[[nodiscard]] std::string HistoryTable(std::span<const files::HistoryEntry> entries);

}  // namespace trammel::app

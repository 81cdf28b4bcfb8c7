// The sheet for a printer's tools: the settings, and what the printer itself tells.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "session/session.h"
#include "tool_offset/commands/sheet_options.h"
#include "tool_offset/procedure/printer_tools.h"

namespace trammel::app {

/// The settings, with the printer's address and key. Errors: as ConfigureSheet; a dialect that is
/// not Klipper's.
/// @param printer  its address; empty: the settings'
[[nodiscard]] Result<SheetConfig> ConfigureForPrinter(const SheetOptions& options,
                                                      const std::string& printer);

/// Takes the tools that are asked for, or all that were found, and how this printer picks them up
/// where nobody says it. Errors: nobody keeps their offsets, and none are named; the printer's.
[[nodiscard]] Result<void> FitToPrinter(const SheetOptions& options, const std::vector<int>& tools,
                                        const procedure::Session& session,
                                        const procedure::PrinterTools& found, SheetConfig& config);

}  // namespace trammel::app

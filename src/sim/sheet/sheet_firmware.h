// Tool-change macros of a printer.cfg, for the virtual sheet.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

/// G-code by upper-case command name.
using SheetMacros = std::map<std::string, std::string>;

/// Reads the `[gcode_macro NAME]` sections of a Klipper configuration; other sections are skipped.
/// Macros must be plain G-code: a template ({…} or {%…%}) is an error (kInput) that names the macro
/// and its line, as is a macro without `gcode:` or a name given twice.
[[nodiscard]] Result<SheetMacros> ParseSheetMacros(std::string_view config);

}  // namespace trammel::sim

// Tool-change macros of a printer.cfg, for the virtual sheet.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

/// G-code by upper-case command name.
using SheetMacros = std::map<std::string, std::string>;

/// Reads the `[gcode_macro NAME]` sections of a Klipper configuration; skips other sections. Macros
/// must be plain G-code. Errors (kInput): a template ({…} or {%…%}), with the macro and its line, a
/// macro without `gcode:`, a duplicate name.
[[nodiscard]] Result<SheetMacros> ParseSheetMacros(std::string_view config);

}  // namespace trammel::sim

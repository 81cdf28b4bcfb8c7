// The settings of the method's original generator: assignments of Python, as its owner keeps them.
#pragma once

#include <string_view>
#include <vector>

#include "base/result.h"
#include "tool_offset/original/original_sheet.h"

namespace trammel::tool_offset {

/// Whether the text calls the generator's print of a sheet.
[[nodiscard]] bool IsOriginalScript(std::string_view text);

/// Reads `pattern.KEY = VALUE`, `pattern.gen.KEY = VALUE`, variables, and for each
/// `pattern.full_interlocked_print(TOOLS, REFERENCE, FILE)` the sheet that it prints with what was
/// set before. The object has whatever name it was given; comments, imports and calls of other
/// prints are passed over. Nothing is run.
/// Errors name the line: more than 1000 lines or a line of more than 1000 characters; anything
/// else of Python; a key that the generator does not have; a value of another type, a call's among
/// them; setattr and its like, after which nothing is known; a geometry
/// other than the published one; no print of a sheet.
[[nodiscard]] Result<std::vector<OriginalSheet>> ReadOriginalScript(std::string_view text);

}  // namespace trammel::tool_offset

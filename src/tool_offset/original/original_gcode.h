// The G-code of the method's original generator: which sheet it prints.
#pragma once

#include <string_view>

#include "base/result.h"
#include "tool_offset/original/original_sheet.h"

namespace trammel::tool_offset {

/// Whether the text has the comments that the original generator puts before its combs.
[[nodiscard]] bool IsOriginalGcode(std::string_view gcode);

/// Reads the tools, the reference tool, the turn on the bed and the programmed offset of each pair
/// from the moves. The place on the bed does not matter.
///
/// Compares every leg, in the file's order, with the published geometry.
/// Errors name the line: a word that is no number, a box or a leg elsewhere than the generator
/// draws it, a comb of another tool than its pair's, a file that is cut off.
/// Cost: one pass; memory for 1400 legs, whatever the file holds.
[[nodiscard]] Result<OriginalSheet> ReadOriginalGcode(std::string_view gcode);

}  // namespace trammel::tool_offset

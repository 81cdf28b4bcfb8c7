// The G-code of the method's original generator: which sheet it prints.
#pragma once

#include <string_view>

#include "base/result.h"
#include "tool_offset/original/original_sheet.h"

namespace trammel::tool_offset {

/// Whether the text has the comments that the original generator puts before its combs.
[[nodiscard]] bool IsOriginalGcode(std::string_view gcode);

/// Follows the moves and says which sheet they draw: tools, reference tool, how it is turned, how
/// far each pair is moved on purpose. Where on the bed it is printed does not matter.
///
/// Every leg is compared with the published geometry, so that a file of another geometry, a changed
/// or a cut-off one is refused.
/// Errors name the line or the comb: a word that is no number, more lines than such a file has, a
/// box or a leg elsewhere than the generator draws it, a comb of another tool than its pair's.
/// Cost: one pass; memory for a thousand moves, whatever the file holds.
[[nodiscard]] Result<OriginalSheet> ReadOriginalGcode(std::string_view gcode);

}  // namespace trammel::tool_offset

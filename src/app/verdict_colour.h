// Verdicts in colour, for terminals.
#pragma once

#include <string>
#include <string_view>

namespace trammel::app {

/// Colours the first column of each line that is a verdict, as in "verdict    good" and in the
/// lines of a series, "  refused: torn": green good, yellow cannot tell, red refused. Columns begin
/// after two spaces. Everything else stays as it is.
/// @param at_line_start  whether the text begins a line.
[[nodiscard]] std::string WithColouredVerdicts(std::string_view text, bool at_line_start);

}  // namespace trammel::app

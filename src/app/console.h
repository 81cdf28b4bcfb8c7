// Standard output and standard error, safe for a process that moves a machine.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::app {

/// Redirects stdout and stderr through a guard, before anything is written. From then on
/// - writing never fails: FinishConsole() reports a closed reader (`| head`, a dropped
///   connection, a dead terminal) or a full disk, and no signal is raised;
/// - all text is escaped (base/utf8.h), whatever its source;
/// - no file takes the descriptor of a standard stream that was closed.
/// It also turns the signal for a file that grows too large into a write error.
void GuardConsole();

/// Restricts standard error to errors, from now on: lines that begin with "trammel: ".
void PrintErrorsOnly();

enum class Colour { kAuto, kAlways, kNever };

/// Colours verdicts from now on, on both streams; kAuto: on terminals, unless NO_COLOR is set
/// (no-color.org) or TERM is dumb.
void ColourVerdicts(Colour when);

/// While it lives, output never blocks: text that a pipe or a stopped terminal does not accept at
/// once is buffered, up to a megabyte.
class ConsoleDoesNotWait {
 public:
  ConsoleDoesNotWait();
  ~ConsoleDoesNotWait();
  ConsoleDoesNotWait(const ConsoleDoesNotWait&) = delete;
  ConsoleDoesNotWait& operator=(const ConsoleDoesNotWait&) = delete;
};

/// Notes that the process was asked to end: from now on no output waits for a reader longer than a
/// moment, not even the last lines.
void WaitForNoReaderAnyMore();

/// Writes the buffered text. Error: standard output lost text that was wanted (a full disk).
[[nodiscard]] Result<void> FinishConsole();

// Verdicts in colour, for terminals.

/// Colours the first column of each line that is a verdict, as in "verdict    good" and in the
/// lines of a series, "  refused: torn": green good, yellow cannot tell, red refused. Columns begin
/// after two spaces. Other text is unchanged.
/// @param at_line_start  true if the text begins a line.
[[nodiscard]] std::string WithColouredVerdicts(std::string_view text, bool at_line_start);

}  // namespace trammel::app

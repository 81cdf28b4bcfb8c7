// Standard output and standard error, made safe for a process that has a machine in motion.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::app {

/// Puts itself behind stdout and stderr, before anything is written. From then on
/// - nothing that is written fails: a reader that has gone (`| head`, a dropped connection, a dead
///   terminal) or a full disk is noticed by FinishConsole(), and no signal comes of it;
/// - text is escaped (base/utf8.h), whoever wrote it and wherever it came from;
/// - a standard stream that was closed takes no file's place.
/// It also lets a file that would grow too large be an error of writing.
void GuardConsole();

/// Lets standard error take errors alone, from now on: what begins with "trammel: ".
void SayErrorsOnly();

enum class Colour { kAuto, kAlways, kNever };

/// Colours verdicts from now on and on either stream: with kAuto on
/// terminals, unless NO_COLOR is set (no-color.org) or TERM is dumb.
void ColourVerdicts(Colour when);

/// While it lives, nothing waits for whoever reads: what a pipe or a stopped terminal does not take
/// at once is kept for later, at most a megabyte.
class ConsoleDoesNotWait {
 public:
  ConsoleDoesNotWait();
  ~ConsoleDoesNotWait();
  ConsoleDoesNotWait(const ConsoleDoesNotWait&) = delete;
  ConsoleDoesNotWait& operator=(const ConsoleDoesNotWait&) = delete;
};

/// Says that the process was asked to end: from now on nothing waits for whoever reads longer than
/// a moment, not even for the last words.
void WaitForNoReaderAnyMore();

/// Writes what was kept. Error: standard output lost text that somebody meant to keep (a full
/// disk).
[[nodiscard]] Result<void> FinishConsole();

// Verdicts in colour, for terminals.

/// Colours the first column of each line that is a verdict, as in "verdict    good" and in the
/// lines of a series, "  refused: torn": green good, yellow cannot tell, red refused. Columns begin
/// after two spaces. Everything else stays as it is.
/// @param at_line_start  whether the text begins a line.
[[nodiscard]] std::string WithColouredVerdicts(std::string_view text, bool at_line_start);

}  // namespace trammel::app

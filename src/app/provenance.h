// Program and time that a result came from.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "measurement/outcome.h"

namespace trammel::app {

/// "trammel 0.1.0".
[[nodiscard]] std::string_view ProgramVersion();

/// Returns the current time, ISO 8601 to the second: "2026-01-02T03:04:05Z".
[[nodiscard]] std::string UtcNow();

/// Formats a time since 1970 in the same way; the plain number if no calendar has it.
[[nodiscard]] std::string UtcOf(double since_1970_s);

/// Returns the provenance: this program, now, from those sources.
[[nodiscard]] measurement::Provenance ProvenanceOf(measurement::Instrument instrument,
                                                   std::vector<std::string> sources);

/// Returns the name of a new recording's folder, with the current time: "tap-20260102T030405Z".
[[nodiscard]] std::string RecordingName(measurement::Instrument instrument);

// Date in the computer's time zone.

/// Returns YYYY-MM-DD in the computer's time zone, as people date files.
[[nodiscard]] std::string Today();

// Next command for the user: the last line of an answer.

/// Prints the user's next command below an answer in text form, in the answer's columns.
/// @param label  of the row: "next", "to undo it"
/// @param text   "trammel pa apply FOLDER", or words that end in a command
/// @param column characters before the text
/// @param where  standard error if standard output contains the answer for a program
void PrintWrapped(std::string_view label, const std::string& text, int column = 18,
                  std::FILE* where = stdout);

/// Returns a command's word for a shell, quoted only where necessary.
[[nodiscard]] std::string ShellQuoted(const std::string& word);

}  // namespace trammel::app

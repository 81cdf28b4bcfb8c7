// Which program found a result, and when.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "measurement/outcome.h"

namespace trammel::app {

/// "trammel 0.1.0".
[[nodiscard]] std::string_view ProgramVersion();

/// Now, ISO 8601 to the second: "2026-01-02T03:04:05Z".
[[nodiscard]] std::string UtcNow();

/// The same of a time since 1970; of one that no calendar has, the number.
[[nodiscard]] std::string UtcOf(double since_1970_s);

/// This program, now, from those sources.
[[nodiscard]] measurement::Provenance ProvenanceOf(measurement::Instrument instrument,
                                                   std::vector<std::string> sources);

/// A folder for what an instrument records, now: "tap-20260102T030405Z".
[[nodiscard]] std::string RecordingName(measurement::Instrument instrument);

// The date where the computer stands.

/// YYYY-MM-DD in the computer's own time zone, as people write dates into files.
[[nodiscard]] std::string Today();

// The command that comes next: the last line of an answer.

/// Says what comes next where an answer is text, in the answer's own columns.
/// @param label  of the row: "next", "to undo it"
/// @param text   "trammel pa apply FOLDER", or words that end in a command
/// @param column characters before the text
/// @param where  standard error where standard output holds the answer for a program
void SayNext(std::string_view label, const std::string& text, int column = 18,
             std::FILE* where = stdout);

/// A word of a command for a shell: as it is, or in quotes where it has to be.
[[nodiscard]] std::string ShellQuoted(const std::string& word);

}  // namespace trammel::app

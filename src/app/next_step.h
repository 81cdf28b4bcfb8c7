// The command that comes next: the last line of an answer.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace trammel::app {

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

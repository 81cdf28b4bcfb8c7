// What is wrong with the words of a command line.
#pragma once

#include <span>
#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace trammel::app {

/// Names the first word that is no command or option, with the one that was meant, or a command or
/// an argument that is missing; else what the parser found.
/// @param program  all commands, as they were registered.
/// @param words    of the command line, without the program's own name.
[[nodiscard]] std::string UsageError(const CLI::App& program, const CLI::ParseError& error,
                                     std::span<const std::string> words);

}  // namespace trammel::app

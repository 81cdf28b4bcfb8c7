// Help, the guide, and remedies for a command line that does not parse.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace CLI {
class App;
class FormatterBase;
class ParseError;
}  // namespace CLI

namespace trammel::app {

// What trammel prints where it is called without a command: the way in, by what its user has.

/// A screen of text: for each thing to measure with, the commands to begin with.
/// @param has  whether this build has a command of the first level.
[[nodiscard]] std::string Guide(const std::function<bool(std::string_view)>& has);

/// Hangs `completion` and `manual`, the tree of commands for shells and for man, below the program.
void AddHelpCommands(CLI::App& cli);

// The words of help, in place of the parser's own.

/// Help with the range of a number as "2 … 9", choices as "a|b", and "not with --other".
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> PlainHelp();

/// The type of a value as help names it: "NUMBER", "2 … 9", "a|b".
/// @param type  as CLI11 names it with its checks: "INT:INT in [2 - 9]".
[[nodiscard]] std::string PlainType(const std::string& type);

// The commands of instruments that are not part of this build (TRAMMEL_INSTRUMENTS).

/// Hangs a command below the program that fails with a sentence on how to build its instrument,
/// whatever follows it; help, completion and manual do not name it.
void AddLeftOutCommand(CLI::App& cli, int& exit_code, const std::string& name);

// What is wrong with the words of a command line.

/// Names the first word that is no command or option, with the one that was meant, or a command or
/// an argument that is missing; else what the parser found.
/// @param program  all commands, as they were registered.
/// @param words    of the command line, without the program's own name.
[[nodiscard]] std::string UsageError(const CLI::App& program, const CLI::ParseError& error,
                                     std::span<const std::string> words);

}  // namespace trammel::app

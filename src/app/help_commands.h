// Help, the guide, and hints for a command line that does not parse.
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

// Text that trammel prints when called without a command: first steps, by the user's equipment.

/// Returns a screen of text: for each object to measure with, the first commands.
/// @param has  true if this build has a command of the first level.
[[nodiscard]] std::string Guide(const std::function<bool(std::string_view)>& has);

/// Adds the commands `completion` and `manual`, which print the command tree for shells and for
/// man.
void AddHelpCommands(CLI::App& cli);

// Formatter of help texts, in place of the parser's own.

/// Returns a formatter that shows the range of a number as "2 … 9", choices as "a|b", and "not with
/// --other".
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> PlainHelp();

/// Returns the type of a value as help shows it: "NUMBER", "2 … 9", "a|b".
/// @param type  CLI11's name with its checks: "INT:INT in [2 - 9]".
[[nodiscard]] std::string PlainType(const std::string& type);

// Commands of instruments that are not part of this build (TRAMMEL_INSTRUMENTS).

/// Adds a command that fails and explains how to build its instrument, whatever its arguments;
/// help, completion and manual omit it.
void AddLeftOutCommand(CLI::App& cli, int& exit_code, const std::string& name);

// Faults in the words of a command line.

/// Returns an error that names the first word that is no command or option, with the nearest match,
/// or a missing command or argument; else the parser's message.
/// @param program  all commands, as registered.
/// @param words    of the command line, without the program's name.
[[nodiscard]] std::string UsageError(const CLI::App& program, const CLI::ParseError& error,
                                     std::span<const std::string> words);

}  // namespace trammel::app

// The words of help and of errors in a command line, in place of the parser's own.
#pragma once

#include <memory>
#include <span>
#include <string>

namespace CLI {
class App;
class FormatterBase;
class ParseError;
}  // namespace CLI

namespace trammel::app {

/// Help with the range of a number as "2 … 9", choices as "a|b", and "not with --other".
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> PlainHelp();

/// The type of a value as help names it: "NUMBER", "2 … 9", "a|b".
/// @param type  as CLI11 names it with its checks: "INT:INT in [2 - 9]".
[[nodiscard]] std::string PlainType(const std::string& type);

/// What is wrong with a command line whose words are all known (Mistyped), with the command whose
/// help lists them.
/// @param words  of the command line, without the program's own name.
[[nodiscard]] std::string PlainError(const CLI::App& program, const CLI::ParseError& error,
                                     std::span<const std::string> words);

}  // namespace trammel::app

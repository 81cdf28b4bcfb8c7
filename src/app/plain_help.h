// The words of help, in place of the parser's own.
#pragma once

#include <memory>
#include <string>

namespace CLI {
class FormatterBase;
}  // namespace CLI

namespace trammel::app {

/// Help with the range of a number as "2 … 9", choices as "a|b", and "not with --other".
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> PlainHelp();

/// The type of a value as help names it: "NUMBER", "2 … 9", "a|b".
/// @param type  as CLI11 names it with its checks: "INT:INT in [2 - 9]".
[[nodiscard]] std::string PlainType(const std::string& type);

}  // namespace trammel::app

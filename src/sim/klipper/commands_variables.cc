// G-code that keeps values: in a macro, or in the file of [save_variables].
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "sim/klipper/commands.h"

namespace trammel::sim {
namespace {

// Texts alone: a Python literal in quotes.
Result<Outcome> SetVariable(VirtualKlipper& machine, const CommandLine& line) {
  const auto macro = TRY(RequiredText(line, "MACRO"));
  const auto name = TRY(RequiredText(line, "VARIABLE"));
  const auto value = TRY(RequiredText(line, "VALUE"));
  const auto found = machine.config().macros.find(UpperCase(macro));
  if (found == machine.config().macros.end()) {
    return Fail(fmt::format("The value '{}' is not valid for MACRO", macro));
  }
  if (found->second.variables.count(name) == 0) {
    return Fail(fmt::format("Unknown gcode_macro variable '{}'", name));
  }
  if (value.size() < 2 || value.front() != '\'' || value.back() != '\'') {
    return Fail(fmt::format("Unable to parse '{}' as a literal", value));
  }
  machine.kept[found->first][name] = value.substr(1, value.size() - 2);
  return Outcome{};
}

// Klipper catches neither what is no literal nor the configuration reader's wrath about a `%`: both
// shut it down.
Result<Outcome> SaveVariable(VirtualKlipper& machine, const CommandLine& line) {
  const auto name = TRY(RequiredText(line, "VARIABLE"));
  const auto value = TRY(RequiredText(line, "VALUE"));
  const bool capital =
      std::any_of(name.begin(), name.end(), [](unsigned char c) { return std::isupper(c) != 0; });
  if (capital) return Fail("VARIABLE must not contain upper case");
  // Of Python's literals those that are JSON but for their quotes.
  std::string literal = value;
  std::replace(literal.begin(), literal.end(), '\'', '"');
  const auto parsed = nlohmann::json::parse(literal, nullptr, false);
  if (parsed.is_discarded() || value.find('%') != std::string::npos) {
    machine.Shutdown("Internal error on command:\"SAVE_VARIABLE\"");
    return Outcome{};
  }
  machine.saved_variables[name] = literal;
  return Outcome{};
}

}  // namespace

const std::map<std::string, Handler>& VariableCommands() {
  static const std::map<std::string, Handler> commands = {{"SET_GCODE_VARIABLE", SetVariable},
                                                          {"SAVE_VARIABLE", SaveVariable}};
  return commands;
}

}  // namespace trammel::sim

#include "app/mistyped.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "app/command_tree.h"
#include "base/utf8.h"
#include "files/suggest.h"

namespace trammel::app {
namespace {

std::string Quoted(const std::string& word) {
  constexpr std::size_t kMostBytes = 60;
  std::string line = Utf8OrReplaced(word, kMostBytes);
  std::replace(line.begin(), line.end(), '\n', ' ');
  return fmt::format("'{}'", EscapedForTerminal(line));
}

const CLI::App* CommandOf(const CLI::App& app, std::string_view word) {
  for (const CLI::App* command : CommandsOf(app)) {
    if (command->get_name() == word) return command;
  }
  return nullptr;
}

std::string MeantFor(std::string_view word, const std::vector<std::string>& known) {
  const std::vector<std::string_view> names(known.begin(), known.end());
  const auto near = files::Nearest(word, names);
  return near ? fmt::format("; did you mean {}?", *near) : "";
}

std::vector<std::string> NamesOfOptions(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

}  // namespace

std::optional<std::string> Mistyped(const CLI::App& program, std::span<const std::string> words) {
  const CLI::App* app = &program;
  std::string path = "trammel";
  bool is_value = false;
  for (const std::string& word : words) {
    if (std::exchange(is_value, false)) continue;
    if (word == "--") break;
    const std::string name = word.substr(0, word.find('='));
    if (name.starts_with("--")) {
      const bool own = app != &program && app->get_option_no_throw(name) != nullptr;
      if (own) continue;
      if (const CLI::Option* option = program.get_option_no_throw(name)) {
        is_value = option->get_type_size() > 0 && name == word;
        continue;
      }
      return fmt::format("{} has no option {}{}", path, Quoted(name),
                         MeantFor(name, NamesOfOptions(*app)));
    }
    const auto commands = NamesOfCommands(*app);
    if (name.starts_with("-") || commands.empty()) continue;
    const CLI::App* command = CommandOf(*app, word);
    if (command == nullptr) {
      const std::string meant = MeantFor(word, commands);
      return fmt::format(
          "{} has no command {}{}{}", path, Quoted(word), meant,
          meant.empty() ? fmt::format("; there are {}", fmt::join(commands, ", ")) : "");
    }
    app = command;
    path += " " + word;
  }
  const auto commands = NamesOfCommands(*app);
  if (commands.empty()) return std::nullopt;
  return fmt::format("{} needs a command: {}", path, fmt::join(commands, ", "));
}

}  // namespace trammel::app

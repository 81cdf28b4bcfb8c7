#include "app/usage_error.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <optional>
#include <regex>
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

/// A command that words name, and what is wrong with one of them; empty: nothing.
struct Reading {
  const CLI::App* command = nullptr;
  std::string path = "trammel";
  std::string fault = {};
};

Reading Read(const CLI::App& program, std::span<const std::string> words) {
  Reading read{&program};
  const auto fault = [&read](std::string text) {
    read.fault = std::move(text);
    return read;
  };
  bool is_value = false;
  for (const std::string& word : words) {
    if (std::exchange(is_value, false)) continue;
    if (word == "--") break;
    const std::string name = word.substr(0, word.find('='));
    if (name.starts_with("--")) {
      const bool own =
          read.command != &program && read.command->get_option_no_throw(name) != nullptr;
      if (own) continue;
      if (const CLI::Option* option = program.get_option_no_throw(name)) {
        is_value = option->get_type_size() > 0 && name == word;
        continue;
      }
      return fault(fmt::format("{} has no option {}{}", read.path, Quoted(name),
                               MeantFor(name, NamesOfOptions(*read.command))));
    }
    const auto commands = NamesOfCommands(*read.command);
    if (name.starts_with("-") || commands.empty()) continue;
    const CLI::App* command = CommandOf(*read.command, word);
    if (command == nullptr) {
      const std::string meant = MeantFor(word, commands);
      return fault(fmt::format(
          "{} has no command {}{}{}", read.path, Quoted(word), meant,
          meant.empty() ? fmt::format("; there are {}", fmt::join(commands, ", ")) : ""));
    }
    read.command = command;
    read.path += " " + word;
  }
  const auto commands = NamesOfCommands(*read.command);
  if (commands.empty()) return read;
  return fault(fmt::format("{} needs a command: {}", read.path, fmt::join(commands, ", ")));
}

/// What an option or argument is, as its command registered it.
std::string DescriptionOf(const CLI::App& app, const std::string& name) {
  const CLI::Option* option = app.get_option_no_throw(name);
  return option == nullptr || option->get_description().empty() ? ""
                                                                : ": " + option->get_description();
}

/// An argument in capitals, as in the usage line.
std::string NameOf(std::string name) {
  if (name.starts_with("-")) return name;
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return name;
}

}  // namespace

std::string UsageError(const CLI::App& program, const CLI::ParseError& error,
                       std::span<const std::string> words) {
  const Reading read = Read(program, words);
  if (!read.fault.empty()) return read.fault + "\n";
  static const std::regex required("([^ ]+) is required");
  static const std::regex missing("(.+): [0-9]+ required .+ missing");
  const std::string text = error.what();
  std::string plain = text;
  std::smatch found;
  if (std::regex_match(text, found, required)) {
    plain = fmt::format("{} needs {}{}", read.path, NameOf(found[1]),
                        DescriptionOf(*read.command, found[1]));
  } else if (std::regex_match(text, found, missing)) {
    plain =
        fmt::format("{} needs a value{}", found[1].str(), DescriptionOf(*read.command, found[1]));
  }
  return fmt::format("{}\n{} --help lists what there is\n", plain, read.path);
}

}  // namespace trammel::app

#include "app/plain_help.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <regex>
#include <utility>
#include <vector>

#include "app/command_tree.h"

namespace trammel::app {
namespace {

// An option as it is typed, an argument in capitals, as in the usage line.
std::string NameOf(std::string name) {
  if (name.starts_with("-")) return name;
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return name;
}

std::string Names(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(NameOf(option->get_name()));
  return fmt::format("{}", fmt::join(names, ", "));
}

// Help as CLI11 writes it, with words of ours for types and conditions.
class Formatter final : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    if (!option->get_option_text().empty()) return " " + option->get_option_text();
    std::string text;
    if (option->get_type_size() != 0) {
      const std::string type = PlainType(option->get_type_name());  // a flag's is empty
      if (!type.empty()) text += " " + type;
      if (!option->get_default_str().empty()) text += "=" + option->get_default_str();
      if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += " ...";
      if (option->get_required()) text += " (required)";
    }
    if (!option->get_needs().empty()) text += fmt::format(" (with {})", Names(option->get_needs()));
    if (!option->get_excludes().empty()) {
      text += fmt::format(" (not with {})", Names(option->get_excludes()));
    }
    return text;
  }

  // Pads by characters: the parser counts bytes, of which "…" has three.
  std::string make_option(const CLI::Option* option, bool positional) const override {
    const std::string name = "  " + make_option_name(option, positional) + make_option_opts(option);
    const std::string padded = fmt::format("{:<{}}", name, get_column_width());
    const std::string description = make_option_desc(option);
    const bool fits = padded.size() > name.size();
    return fits || description.empty()
               ? padded + description + "\n"
               : fmt::format("{}\n{:{}}{}\n", name, "", get_column_width(), description);
  }
};

// The command that the words name.
std::pair<const CLI::App*, std::string> NamedCommand(const CLI::App& program,
                                                     std::span<const std::string> words) {
  const CLI::App* app = &program;
  std::string path = "trammel";
  for (const std::string& word : words) {
    const auto commands = CommandsOf(*app);
    const auto command = std::ranges::find_if(
        commands, [&word](const CLI::App* one) { return one->get_name() == word; });
    if (command == commands.end()) continue;
    app = *command;
    path += " " + word;
  }
  return {app, path};
}

// What each positional argument is, as its command registered it.
std::string DescriptionOf(const CLI::App& app, const std::string& name) {
  const CLI::Option* option = app.get_option_no_throw(name);
  return option == nullptr || option->get_description().empty() ? ""
                                                                : ": " + option->get_description();
}

}  // namespace

std::string PlainType(const std::string& type) {
  static const std::regex range(R"(.* in \[(.*) - (.*)\])");
  static const std::regex choice(R"(.*\{(.*)\})");
  std::smatch found;
  if (std::regex_match(type, found, range)) {
    return fmt::format("{} … {}", found[1].str(), found[2].str());
  }
  if (std::regex_match(type, found, choice)) {
    std::string choices = found[1];
    std::ranges::replace(choices, ',', '|');
    return choices;
  }
  const std::string name = type.substr(0, type.find(':'));
  return name == "INT" || name == "UINT" || name == "FLOAT" ? "NUMBER" : name;
}

std::shared_ptr<CLI::FormatterBase> PlainHelp() { return std::make_shared<Formatter>(); }

std::string PlainError(const CLI::App& program, const CLI::ParseError& error,
                       std::span<const std::string> words) {
  const auto [app, path] = NamedCommand(program, words);
  const std::string text = error.what();
  const auto match = [&text](const char* pattern) {
    std::smatch found;
    std::vector<std::string> parts;
    if (std::regex_match(text, found, std::regex(pattern))) {
      for (std::size_t i = 1; i < found.size(); ++i) parts.push_back(found[i]);
    }
    return parts;
  };
  std::string plain = text;
  if (const auto required = match("([^ ]+) is required"); !required.empty()) {
    plain =
        fmt::format("{} needs {}{}", path, NameOf(required[0]), DescriptionOf(*app, required[0]));
  } else if (const auto value = match("(.+): [0-9]+ required .+ missing"); !value.empty()) {
    plain = fmt::format("{} needs a value{}", value[0], DescriptionOf(*app, value[0]));
  } else if (const auto two = match("(.+) excludes (.+)"); !two.empty()) {
    plain = fmt::format("{} and {} cannot be given together", two[0], two[1]);
  } else if (const auto needs = match("(.+) requires (.+)"); !needs.empty()) {
    plain = fmt::format("{} is of use with {} alone", needs[0], needs[1]);
  } else if (const auto extra = match("The following arguments? (?:was|were) not expected: (.*)");
             !extra.empty()) {
    plain = fmt::format("{} has no use for: {}", path, extra[0]);
  } else if (const auto number = match("Could not convert: (.+) = (.*)"); !number.empty()) {
    plain = fmt::format("{} {}: it must be a number", number[0], number[1]);
  } else if (const auto range = match("(.+): Value (.+) not in range (.+) to (.+)");
             !range.empty()) {
    plain = fmt::format("{} {}: it must be {} … {}", range[0], range[1], range[2], range[3]);
  }
  return fmt::format("{}\n{} --help lists what there is\n", plain, path);
}

}  // namespace trammel::app

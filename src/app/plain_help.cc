#include "app/plain_help.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <regex>
#include <vector>

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

}  // namespace trammel::app

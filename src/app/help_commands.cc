#include "app/help_commands.h"

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
#include "app/commands.h"
#include "base/text.h"
#include "base/utf8.h"
#include "files/json_object.h"

namespace trammel::app {
namespace {

struct Way {
  std::string_view command;  ///< required first-level command
  std::string_view have;
  std::string_view begin;
};

constexpr Way kWays[] = {
    {"pa", "a phone, any printer", "trammel pa pattern --material pla --photo --out pattern.gcode"},
    {"pa", "  … then print it, photograph it", "trammel pa analyze PHOTO --plan pattern.plan.json"},
    {"pa", "a phone, a Klipper printer", "trammel pa print --photo --material pla --printer HOST"},
    {"pa", "a camera and a line laser (Klipper)", "trammel doctor --printer HOST"},
    {"pa", "  … then", "trammel pa calibrate --material pla --printer HOST"},
    {"tap", "a load cell (Klipper)", "trammel tap watch --printer HOST"},
    {"offset", "several tools; a scanner or a phone", "trammel offset start --printer HOST"},
    {"align", "a mill, a camera in its spindle", "trammel align init"},
    {"pa", "none of these yet", "trammel-sim printer"},
};

}  // namespace

std::string Guide(const std::function<bool(std::string_view)>& has) {
  std::string text =
      "trammel measures what a machine has made, and calibrates it.\n\n"
      "What do you have?                     Begin with\n";
  for (const Way& way : kWays) {
    if (has(way.command)) text += fmt::format("  {:<36}{}\n", way.have, way.begin);
  }
  return text +
         "\nHOST is the address of the printer's Moonraker, such as mainsail.local. Nothing heats "
         "or\n"
         "moves before a material is named, and nothing is applied unasked.\n"
         "All commands: trammel --help. Settings: trammel config init. Manual: docs/README.md\n";
}

void AddHelpCommands(CLI::App& cli) {
  CLI::App* completion =
      cli.add_subcommand("completion", "print a script that completes commands and options")
          ->require_subcommand(1);
  completion
      ->add_subcommand("bash",
                       fmt::format("for bash: source <({} completion bash)", cli.get_name()))
      ->callback([&cli] { fmt::print("{}", BashCompletion(cli)); });
  completion->add_subcommand("zsh", fmt::format("for zsh: a file _{} of its fpath", cli.get_name()))
      ->callback([&cli] { fmt::print("{}", ZshCompletion(cli)); });
  cli.add_subcommand("manual",
                     fmt::format("print the manual page: {} manual | man -l -", cli.get_name()))
      ->callback([&cli] { fmt::print("{}", ManualPage(cli)); });
}

namespace {

// Returns an option as typed, or an argument in capitals, as in the usage line.
std::string NameOf(std::string name) { return name.starts_with("-") ? name : UpperCase(name); }

std::string Names(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(NameOf(option->get_name()));
  return fmt::format("{}", fmt::join(names, ", "));
}

// CLI11's help with our own texts for types and conditions.
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

void AddLeftOutCommand(CLI::App& cli, int& exit_code, const std::string& name) {
  CLI::App* const command =
      cli.add_subcommand(name)->group("")->fallthrough(false)->prefix_command();
  command->set_help_flag();
  const std::string full = cli.get_parent() == nullptr ? name : cli.get_name() + " " + name;
  command->callback([name = full, &exit_code] {
    exit_code = PrintError(
        {ErrorKind::kInput,
         fmt::format(
             "trammel {0} is not part of this build (./run builds pressure advance alone); build "
             "all of "
             "trammel with cmake --preset release && cmake --build --preset release, and use "
             "build/release/src/app/trammel {0} (docs/howto/install.md)",
             name)});
  });
}

namespace {

std::string Quoted(const std::string& word) {
  constexpr std::size_t kMaxBytes = 60;
  std::string line = Utf8OrReplaced(word, kMaxBytes);
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

/// Command named by the words, and the fault of one of them; empty: none.
struct Reading {
  const CLI::App* command = nullptr;
  std::string path;
  std::string fault = {};
};

Reading Read(const CLI::App& program, std::span<const std::string> words) {
  Reading read{&program, program.get_name()};
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

/// Returns an option's or argument's registered description.
std::string DescriptionOf(const CLI::App& app, const std::string& name) {
  const CLI::Option* option = app.get_option_no_throw(name);
  return option == nullptr || option->get_description().empty() ? ""
                                                                : ": " + option->get_description();
}

/// An argument in capitals, as in the usage line.
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

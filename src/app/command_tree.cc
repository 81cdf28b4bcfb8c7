#include "app/command_tree.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <iterator>

#include "app/help_commands.h"

namespace trammel::app {
namespace {

/// Visits a command and all below it; `path` is its full name.
void ForEachCommand(const CLI::App& app, const std::string& path,
                    const std::function<void(const CLI::App&, const std::string&)>& visit) {
  visit(app, path);
  for (const CLI::App* command : CommandsOf(app)) {
    ForEachCommand(*command, path + " " + command->get_name(), visit);
  }
}

std::vector<std::string> NamesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return names;
}

std::vector<std::string> OptionsOf(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    std::ranges::copy(NamesOf(*option), std::back_inserter(names));
  }
  return names;
}

/// Returns the program's options that every command accepts: all but --help and --version.
std::vector<const CLI::Option*> SharedOptions(const CLI::App& program) {
  std::vector<const CLI::Option*> shared;
  for (const CLI::Option* option : program.get_options()) {
    if (option != program.get_help_ptr() && !option->check_lname("version")) {
      shared.push_back(option);
    }
  }
  return shared;
}

/// Escapes a text for troff: no line is a request, no hyphen becomes a dash.
std::string Escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    const bool at_line = escaped.empty() || escaped.back() == '\n';
    if (at_line && (c == '.' || c == '\'')) escaped += "\\&";
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string Synopsis(const CLI::App& app, const std::string& path) {
  std::string line = "\\fB" + Escaped(path) + "\\fR";
  if (!CommandsOf(app).empty()) return line + " \\fICOMMAND\\fR";
  line += " [\\fIOPTIONS\\fR]";
  for (const CLI::Option* option : app.get_options()) {
    if (option->nonpositional()) continue;
    const std::string name = "\\fI" + Escaped(option->get_name(true)) + "\\fR";
    line += option->get_required() ? " " + name : " [" + name + "]";
  }
  return line;
}

std::string OptionEntry(const CLI::Option& option) {
  const std::string type = option.get_type_size() == 0 ? "" : PlainType(option.get_type_name());
  const std::string value = type.empty() ? "" : " \\fI" + Escaped(type) + "\\fR";
  const std::string standard =
      option.get_default_str().empty() ? "" : fmt::format(" ({})", option.get_default_str());
  return fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", Escaped(option.get_name(true, true)), value,
                     Escaped(option.get_description() + standard));
}

/// Returns the program's description without its leading name.
std::string DescriptionOf(const CLI::App& program) {
  const std::string text = program.get_description();
  const std::string name = program.get_name() + ": ";
  return text.starts_with(name) ? text.substr(name.size()) : text;
}

}  // namespace

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

std::vector<std::string> NamesOfCommands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : CommandsOf(app)) names.push_back(command->get_name());
  return names;
}

std::string BashCompletion(const CLI::App& program) {
  std::string cases;
  std::vector<std::string> shared;
  for (const CLI::Option* option : SharedOptions(program)) {
    std::ranges::copy(NamesOf(*option), std::back_inserter(shared));
  }
  ForEachCommand(program, program.get_name(), [&](const CLI::App& app, const std::string& path) {
    std::vector<std::string> options = OptionsOf(app);
    if (&app != &program) std::ranges::copy(shared, std::back_inserter(options));
    cases += fmt::format("    '{}') commands='{}' options='{}' ;;\n", path,
                         fmt::join(NamesOfCommands(app), " "), fmt::join(options, " "));
  });
  return fmt::format(R"(# bash completion for {0}, made by `{0} completion bash`.
_{0}_of() {{
  case $1 in
{1}    *) commands='' options='' ;;
  esac
}}
_{0}_words() {{
  local word commands options current='' command={0} i=0
  _{0}_of "$command"
  for word in "${{COMP_WORDS[@]}}"; do
    if [[ $i -eq $COMP_CWORD ]]; then
      current=$word
      break
    elif [[ $i -gt 0 && -n $word && " $commands " == *" $word "* ]]; then
      command="$command $word"
      _{0}_of "$command"
    fi
    i=$((i + 1))
  done
  if [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$current"))
  elif [[ -n $commands ]]; then
    COMPREPLY=($(compgen -W "$commands" -- "$current"))
  else
    COMPREPLY=()
  fi
}}
complete -o default -F _{0}_words {0}
)",
                     program.get_name(), cases);
}

std::string ZshCompletion(const CLI::App& program) {
  return fmt::format(
      "#compdef {0}\nautoload -U +X bashcompinit && bashcompinit\n{1}_bash_complete -o default -F "
      "_{0}_words\n",
      program.get_name(), BashCompletion(program));
}

std::string ManualPage(const CLI::App& program) {
  std::string page = fmt::format(
      ".TH {0} 1 \"\" \"{1}\"\n.SH NAME\n{0} \\- {2}\n.SH SYNOPSIS\n\\fB{0}\\fR "
      "\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.SH COMMANDS\n",
      program.get_name(), program.version(), Escaped(DescriptionOf(program)));
  ForEachCommand(program, program.get_name(), [&](const CLI::App& app, const std::string& path) {
    if (&app == &program || !CommandsOf(app).empty()) return;
    page += fmt::format(".SS {}\n{}\n", Synopsis(app, path), Escaped(app.get_description()));
    for (const CLI::Option* option : app.get_options()) {
      if (option != app.get_help_ptr()) page += OptionEntry(*option);
    }
  });
  const std::vector<const CLI::Option*> shared = SharedOptions(program);
  if (!shared.empty()) page += ".SH OPTIONS OF EVERY COMMAND\n";
  for (const CLI::Option* option : shared) page += OptionEntry(*option);
  page +=
      ".SH EXIT STATUS\n"
      ".TP\n0\na good answer\n"
      ".TP\n1\nthe command, a file or a setting cannot be used\n"
      ".TP\n2\nthe measurement cannot be trusted: refused, or it cannot tell\n"
      ".TP\n3\nthe machine failed or was not ready\n"
      ".TP\n4\nthe command would have been unsafe; nothing was done\n"
      ".TP\n70\na fault of the program itself\n"
      ".TP\n130\nstopped by its user\n"
      ".SH FILES\n.TP\n\\fBtrammel.toml\\fR\nsettings of this folder's printer; "
      "\\fBtrammel config keys\\fR prints all of them\n";
  return page;
}

}  // namespace trammel::app

// The tree of commands as text for shells and for man, made from what --help is made from.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trammel::app {

/// The commands below one, but for those that its help does not name (of an empty group).
[[nodiscard]] std::vector<const CLI::App*> CommandsOf(const CLI::App& app);
[[nodiscard]] std::vector<std::string> NamesOfCommands(const CLI::App& app);

/// A script for bash that completes commands, options and, where neither is meant, files. Options
/// of the program but --help and --version are taken to be every command's (CLI::App::fallthrough).
[[nodiscard]] std::string BashCompletion(const CLI::App& program);

/// The same for zsh, which takes bash's scripts through bashcompinit.
[[nodiscard]] std::string ZshCompletion(const CLI::App& program);

/// A manual page (man-pages(7), troff) with every command and option.
[[nodiscard]] std::string ManualPage(const CLI::App& program);

}  // namespace trammel::app

// Completion scripts and manual page, generated from the same command tree as --help.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trammel::app {

/// Returns the direct subcommands of a command, except those that its help omits (of an empty
/// group).
[[nodiscard]] std::vector<const CLI::App*> CommandsOf(const CLI::App& app);
[[nodiscard]] std::vector<std::string> NamesOfCommands(const CLI::App& app);

/// Returns a bash script that completes commands, options and, for other words, files. Assumes that
/// the program's options except --help and --version apply to every command
/// (CLI::App::fallthrough).
[[nodiscard]] std::string BashCompletion(const CLI::App& program);

/// Returns the same for zsh, which loads bash's scripts through bashcompinit.
[[nodiscard]] std::string ZshCompletion(const CLI::App& program);

/// Returns a manual page (man-pages(7), troff) with every command and option.
[[nodiscard]] std::string ManualPage(const CLI::App& program);

}  // namespace trammel::app

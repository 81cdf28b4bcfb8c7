#include "app/help_commands.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "app/command_tree.h"

namespace trammel::app {

void AddHelpCommands(CLI::App& cli) {
  CLI::App* completion =
      cli.add_subcommand("completion", "print a script that completes commands and options")
          ->require_subcommand(1);
  completion->add_subcommand("bash", "for bash: source <(trammel completion bash)")
      ->callback([&cli] { fmt::print("{}", BashCompletion(cli)); });
  completion->add_subcommand("zsh", "for zsh: a file _trammel of its fpath")->callback([&cli] {
    fmt::print("{}", ZshCompletion(cli));
  });
  cli.add_subcommand("manual", "print the manual page: trammel manual | man -l -")
      ->callback([&cli] { fmt::print("{}", ManualPage(cli)); });
}

}  // namespace trammel::app

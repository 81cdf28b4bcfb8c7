#include "tap/commands/tap_commands.h"

#include <CLI/CLI.hpp>

namespace trammel::app {

void AddTapCommands(CLI::App& tap, int& exit_code) {
  tap.require_subcommand(1);
  AddTapAnalyzeCommand(tap, exit_code);
  AddTapPlotCommand(tap, exit_code);
  AddTapWatchCommand(tap, exit_code);
}

}  // namespace trammel::app

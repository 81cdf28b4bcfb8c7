#include "tap/commands/tap_commands.h"

#include <CLI/CLI.hpp>

namespace trammel::app {

void AddTapCommands(CLI::App& cli, int& exit_code) {
  CLI::App* tap =
      cli.add_subcommand("tap", "contact height from a load cell")->require_subcommand(1);
  AddTapAnalyzeCommand(*tap, exit_code);
  AddTapCompareCommand(*tap, exit_code);
  AddTapPlotCommand(*tap, exit_code);
  AddTapTuneCommand(*tap, exit_code);
  AddTapWatchCommand(*tap, exit_code);
}

}  // namespace trammel::app

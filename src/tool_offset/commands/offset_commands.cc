#include "tool_offset/commands/offset_commands.h"

#include <CLI/CLI.hpp>

namespace trammel::app {

void AddOffsetCommands(CLI::App& cli, int& exit_code) {
  CLI::App* offset = cli.add_subcommand("offset", "XY offsets of tools, and backlash, from a scan")
                         ->require_subcommand(1);
  AddOffsetPatternCommand(*offset, exit_code);
  AddOffsetApplyCommand(*offset, exit_code);
  AddOffsetScanCommand(*offset, exit_code);
  AddOffsetAnalyzeCommand(*offset, exit_code);
}

}  // namespace trammel::app

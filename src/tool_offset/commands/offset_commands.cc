#include "tool_offset/commands/offset_commands.h"

#include <CLI/CLI.hpp>

namespace trammel::app {

void AddOffsetCommands(CLI::App& offset, int& exit_code) {
  offset.require_subcommand(1);
  AddOffsetStartCommand(offset, exit_code);
  AddOffsetPatternCommand(offset, exit_code);
  AddOffsetApplyCommand(offset, exit_code);
  AddOffsetScanCommand(offset, exit_code);
  AddOffsetAnalyzeCommand(offset, exit_code);
  AddOffsetMeasureCommand(offset, exit_code);
}

}  // namespace trammel::app

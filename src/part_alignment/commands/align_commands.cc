#include "part_alignment/commands/align_commands.h"

#include <CLI/CLI.hpp>

namespace trammel::app {

void AddAlignCommands(CLI::App& align, int& exit_code) {
  align.require_subcommand(1);
  AddAlignInitCommand(align, exit_code);
  AddAlignBoardCommand(align, exit_code);
  AddAlignBudgetCommand(align, exit_code);
  AddAlignCalibrateCommand(align, exit_code);
  AddAlignCameraCommand(align, exit_code);
  AddAlignFitCommand(align, exit_code);
  AddAlignSurveyCommand(align, exit_code);
  AddAlignTargetsCommand(align, exit_code);
  AddAlignCorrectCommand(align, exit_code);
  AddAlignMeasureCommand(align, exit_code);
  AddAlignPlanCommand(align, exit_code);
  AddAlignSolveCommand(align, exit_code);
}

}  // namespace trammel::app

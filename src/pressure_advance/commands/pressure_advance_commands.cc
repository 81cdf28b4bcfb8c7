#include "pressure_advance/commands/pressure_advance_commands.h"

#include <CLI/CLI.hpp>

namespace trammel::app {

void AddPressureAdvanceCommands(CLI::App& pa, int& exit_code) {
  pa.require_subcommand(1);
  AddSetupCommand(pa, exit_code);
  AddAnalyzeCommand(pa, exit_code);
  AddPhotoCommand(pa, exit_code);
  AddPatternCommand(pa, exit_code);
  AddCalibrateCommands(pa, exit_code);
  AddApplyCommand(pa, exit_code);
  AddTableCommand(pa, exit_code);
  AddExportCommand(pa, exit_code);
  AddValidateCommand(pa, exit_code);
}

}  // namespace trammel::app

// Commands below `trammel align`.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds the commands to the group; each stores its exit code (app/commands.h).
void AddAlignCommands(CLI::App& align, int& exit_code);

/// Each function adds its command below `parent`.
void AddAlignBoardCommand(CLI::App& parent, int& exit_code);
void AddAlignBudgetCommand(CLI::App& parent, int& exit_code);
void AddAlignCalibrateCommand(CLI::App& parent, int& exit_code);
void AddAlignCameraCommand(CLI::App& parent, int& exit_code);
void AddAlignFitCommand(CLI::App& parent, int& exit_code);
void AddAlignSurveyCommand(CLI::App& parent, int& exit_code);
void AddAlignTargetsCommand(CLI::App& parent, int& exit_code);
void AddAlignCorrectCommand(CLI::App& parent, int& exit_code);
void AddAlignInitCommand(CLI::App& parent, int& exit_code);
void AddAlignMeasureCommand(CLI::App& parent, int& exit_code);
void AddAlignPlanCommand(CLI::App& parent, int& exit_code);
void AddAlignSolveCommand(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

// The commands below `trammel align`.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

void AddAlignCorrectCommand(CLI::App& parent, int& exit_code);
void AddAlignMeasureCommand(CLI::App& parent, int& exit_code);
void AddAlignPlanCommand(CLI::App& parent, int& exit_code);
void AddAlignSolveCommand(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

// The commands below `trammel align` that stand before and behind a measurement.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// As in app/commands.h.
void AddAlignBudgetCommand(CLI::App& parent, int& exit_code);
void AddAlignCalibrateCommand(CLI::App& parent, int& exit_code);
void AddAlignCameraCommand(CLI::App& parent, int& exit_code);
void AddAlignFitCommand(CLI::App& parent, int& exit_code);
void AddAlignStudyCommand(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

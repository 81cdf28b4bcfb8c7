// The commands of pressure advance: `trammel pa`, and `trammel doctor`.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Fills the group; each command stores its exit code (app/commands.h).
void AddPressureAdvanceCommands(CLI::App& pa, int& exit_code);

/// Each hangs its command below `parent`.
void AddAnalyzeCommand(CLI::App& parent, int& exit_code);
void AddPhotoCommand(CLI::App& parent, int& exit_code);
void AddPatternCommand(CLI::App& parent, int& exit_code);
/// `calibrate`, `print` and `scan`.
void AddCalibrateCommands(CLI::App& parent, int& exit_code);
void AddApplyCommand(CLI::App& parent, int& exit_code);
void AddExportCommand(CLI::App& parent, int& exit_code);
void AddTableCommand(CLI::App& parent, int& exit_code);
void AddValidateCommand(CLI::App& parent, int& exit_code);
void AddSetupCommand(CLI::App& parent, int& exit_code);
/// Makes a command `trammel doctor`.
void AddDoctorCommand(CLI::App& doctor, int& exit_code);

}  // namespace trammel::app

// Commands of pressure advance: `trammel pa`, and `trammel doctor`.
#pragma once

#include "service/job_kind.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds the subcommands; each stores its exit code (app/commands.h).
void AddPressureAdvanceCommands(CLI::App& pa, int& exit_code);

/// Each adds its command to `parent`.
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
/// Sets a command up as `trammel doctor`.
void AddDoctorCommand(CLI::App& doctor, int& exit_code);

// Jobs of pressure advance for `trammel serve`.

/// `pa calibrate` as a job, with the macros of klipper/trammel.cfg that ask for it, and `pa apply`
/// of what it found. Heats nothing where the settings name no temperatures.
[[nodiscard]] service::JobKind PressureAdvanceJob();

/// `pa print --photo` as a job, without a laser; its last word asks for the photo.
[[nodiscard]] service::JobKind PhotoPatternJob();

/// `pa photo` as a job, and `pa apply` of what it found. Moves and heats nothing.
[[nodiscard]] service::JobKind PhotoJob();

}  // namespace trammel::app

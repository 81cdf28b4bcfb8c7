// The commands below `trammel sim`: virtual machines, and what eyes see of their work.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Fills the group; each command stores its exit code (app/commands.h).
void AddSimCommands(CLI::App& sim, int& exit_code);

/// Each hangs its command below `parent`.
void AddSimPrinter(CLI::App& parent, int& exit_code);
void AddSimCamera(CLI::App& parent, int& exit_code);
void AddSimMill(CLI::App& parent, int& exit_code);
void AddSimSheet(CLI::App& parent, int& exit_code);
void AddSimSpindle(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

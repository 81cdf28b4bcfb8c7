// The commands below `trammel sim`: virtual machines, and what eyes see of their work.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// The whole group, below the program; each command stores its exit code (app/commands.h).
void AddSimCommand(CLI::App& cli, int& exit_code);

/// Each hangs its command below `parent`.
void AddSimPrinter(CLI::App& parent, int& exit_code);
void AddSimCamera(CLI::App& parent, int& exit_code);
void AddSimSheet(CLI::App& parent, int& exit_code);
void AddSimSpindle(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

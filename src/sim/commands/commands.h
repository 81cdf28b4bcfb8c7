// Commands of trammel-sim: virtual machines, and the view of cameras and scanners on their work.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Each adds its command to `program`; the command stores its exit code (app/commands.h).
void AddSimScan(CLI::App& program, int& exit_code);
void AddSimPhoto(CLI::App& program, int& exit_code);
void AddSimPattern(CLI::App& program, int& exit_code);
void AddSimPrinter(CLI::App& program, int& exit_code);
void AddSimSheet(CLI::App& program, int& exit_code);
void AddSimMill(CLI::App& program, int& exit_code);
void AddSimSpindle(CLI::App& program, int& exit_code);

}  // namespace trammel::app

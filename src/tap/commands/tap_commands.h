// Commands below `trammel tap`.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds the commands to the group; each stores its exit code (app/commands.h).
void AddTapCommands(CLI::App& tap, int& exit_code);

/// Each function adds its command below `parent`.
void AddTapAnalyzeCommand(CLI::App& parent, int& exit_code);
void AddTapPlotCommand(CLI::App& parent, int& exit_code);
void AddTapWatchCommand(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

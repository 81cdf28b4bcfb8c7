// The commands below `trammel tap`.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// The whole group, below the program; each command stores its exit code (app/commands.h).
void AddTapCommands(CLI::App& cli, int& exit_code);

/// Each hangs its command below `parent`.
void AddTapAnalyzeCommand(CLI::App& parent, int& exit_code);
void AddTapCompareCommand(CLI::App& parent, int& exit_code);
void AddTapPlotCommand(CLI::App& parent, int& exit_code);
void AddTapTuneCommand(CLI::App& parent, int& exit_code);
void AddTapWatchCommand(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

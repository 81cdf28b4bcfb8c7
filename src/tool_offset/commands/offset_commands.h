// Commands below `trammel offset`: their group, the pattern and the scan of a sheet.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds the commands to the group; each stores its exit code (app/commands.h).
void AddOffsetCommands(CLI::App& offset, int& exit_code);

/// Each function adds its command below `parent`.
void AddOffsetStartCommand(CLI::App& parent, int& exit_code);
void AddOffsetPatternCommand(CLI::App& parent, int& exit_code);
void AddOffsetApplyCommand(CLI::App& parent, int& exit_code);
void AddOffsetScanCommand(CLI::App& parent, int& exit_code);
void AddOffsetAnalyzeCommand(CLI::App& parent, int& exit_code);
void AddOffsetMeasureCommand(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

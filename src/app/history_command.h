// `trammel history`: what was measured, and what was applied of it.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds the subcommands; each stores its exit code (app/commands.h).
void AddHistoryCommands(CLI::App& history, int& exit_code);

}  // namespace trammel::app

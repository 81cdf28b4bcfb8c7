// `trammel history`: what was measured, and what was applied of it.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Hangs the command below the program; it stores its exit code (app/commands.h).
void AddHistoryCommand(CLI::App& cli, int& exit_code);

}  // namespace trammel::app

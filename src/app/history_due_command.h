// `trammel history due` and `snooze`: what is to be measured anew.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds both to the group; each stores its exit code (app/commands.h).
void AddHistoryDueCommands(CLI::App& history, int& exit_code);

}  // namespace trammel::app

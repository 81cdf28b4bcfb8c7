// `trammel config`: the settings of a printer.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Hangs the command below the program; it stores its exit code (app/commands.h).
void AddConfigCommand(CLI::App& cli, int& exit_code);

}  // namespace trammel::app

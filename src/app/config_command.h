// `trammel config`: the settings of a printer.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds the subcommands; each stores its exit code (app/commands.h).
void AddConfigCommands(CLI::App& config, int& exit_code);

}  // namespace trammel::app

// `trammel completion` and `trammel manual`: the tree of commands for shells and for man.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// Hangs both below the program.
void AddHelpCommands(CLI::App& cli);

}  // namespace trammel::app

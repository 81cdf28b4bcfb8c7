// Below `trammel align`: targets to print.
#pragma once

namespace CLI {
class App;
}

namespace trammel::app {

/// `trammel align targets`. Stores its exit code as those of commands.h do.
void AddAlignTargetsCommand(CLI::App& parent, int& exit_code);

}  // namespace trammel::app

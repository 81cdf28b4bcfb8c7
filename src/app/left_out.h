// The commands of instruments that are not part of this build (TRAMMEL_INSTRUMENTS).
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace trammel::app {

/// Hangs a command below the program that fails with a sentence on how to build its instrument,
/// whatever follows it; help, completion and manual do not name it.
void AddLeftOutCommand(CLI::App& cli, int& exit_code, const std::string& name);

}  // namespace trammel::app

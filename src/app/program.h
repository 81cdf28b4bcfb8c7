// Runs a program of commands: common options, errors and exit code.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trammel::app {

struct Program {
  std::string name;
  std::string text;  ///< what it does, for the help
  /// Adds the program's commands, each of which stores its exit code. `words` are the program's
  /// arguments.
  void (*add_commands)(CLI::App& program, int& exit_code, const std::vector<std::string>& words);
  /// Returns the text printed when there are no arguments; null: an error is printed instead.
  std::string (*guide)() = nullptr;
};

/// Runs the command that the arguments name. @returns the exit code of main.
[[nodiscard]] int RunProgram(const Program& program, int argc, char** argv);

}  // namespace trammel::app

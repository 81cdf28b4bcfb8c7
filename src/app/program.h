// A program of commands: its common options, its errors and its exit code.
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
  /// Adds its commands. `words` are the program's arguments; each command stores its exit code.
  void (*add_commands)(CLI::App& program, int& exit_code, const std::vector<std::string>& words);
  /// The text in place of an error where there are no arguments; none: the error.
  std::string (*guide)() = nullptr;
};

/// Runs the command that the arguments name. @returns the exit code for main.
[[nodiscard]] int RunProgram(const Program& program, int argc, char** argv);

}  // namespace trammel::app

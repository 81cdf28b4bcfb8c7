// Runs the trammel that was built, as a user would.
#pragma once

#include <filesystem>
#include <ostream>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::test {

struct CommandResult {
  int exit_code = -1;           ///< -1 where it did not end by itself
  std::string standard_output;  ///< output as read through a pipe
  std::string standard_error;
  std::string output;  ///< both, standard output first
};
/// Prints a run for GoogleTest.
inline void PrintTo(const CommandResult& run, std::ostream* out) {
  *out << "exit code " << run.exit_code << "\n" << run.output;
}

struct RunLimits {
  long memory_kb = 0;  ///< address space; 0: no limit
};

/// @param arguments  As typed behind `trammel` into a shell; `sim …` runs `trammel-sim …`.
/// @param folder     The current folder of the command; must exist.
[[nodiscard]] CommandResult RunTrammel(const std::string& arguments,
                                       const std::filesystem::path& folder,
                                       const RunLimits& limits = {});

}  // namespace trammel::test

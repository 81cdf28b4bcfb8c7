// Files that a command is about to write.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace trammel::app {

/// An error that names the first of the paths that is there already, unless `force`, that no file
/// is to be written to (files/new_file.h), or that comes twice. Looks before anything is written:
/// all or none.
[[nodiscard]] Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths,
                                             bool force);

struct OutputFile {
  std::filesystem::path path;
  std::string bytes;
};

/// Writes all of them, or none where one is there already, unless `force`.
[[nodiscard]] Result<void> WriteOutputs(const std::vector<OutputFile>& outputs, bool force);

}  // namespace trammel::app

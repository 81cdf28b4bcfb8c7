// Files that a command is about to write.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"

namespace trammel::app {

/// An error that names the first of the paths that is there already, unless `force`, or that comes
/// twice. Looks before anything is written: all or none.
[[nodiscard]] Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths,
                                             bool force);

}  // namespace trammel::app

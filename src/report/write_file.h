// The one place where the report touches the file system.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace trammel::report {

/// Writes the bytes beside the path and renames, so that a half-written file never stands under
/// this name. Folders are not made. Errors name the path and what the system said.
[[nodiscard]] Result<void> WriteFile(const std::filesystem::path& path, std::string_view bytes);

}  // namespace trammel::report

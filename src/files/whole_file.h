// Files read whole, within bounds.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace trammel::files {

/// Errors: not there, a folder, not readable, larger than `max_bytes`.
[[nodiscard]] Result<std::string> ReadWholeFile(const std::filesystem::path& path,
                                                std::size_t max_bytes);

/// The same for a file that another file names, or that is looked for beside one: never a pipe or a
/// device, which could make it wait without end.
[[nodiscard]] Result<std::string> ReadNamedFile(const std::filesystem::path& path,
                                                std::size_t max_bytes);

}  // namespace trammel::files

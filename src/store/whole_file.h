// Files read and written whole: the one place where results and settings meet the file system.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::store {

/// Errors: not there, a folder, not readable, larger than `max_bytes`.
[[nodiscard]] Result<std::string> ReadWholeFile(const std::filesystem::path& path,
                                                std::size_t max_bytes);

/// The same for a file that another file names, or that is looked for beside one: never a pipe or a
/// device, which could make it wait without end.
[[nodiscard]] Result<std::string> ReadNamedFile(const std::filesystem::path& path,
                                                std::size_t max_bytes);

/// Writes beside the target and renames, so that a half-written file never stands under this name.
/// Folders are not made. Errors (not writable, disk full) name the path and what the system said.
[[nodiscard]] Result<void> WriteWholeFile(const std::filesystem::path& path,
                                          std::string_view bytes);

}  // namespace trammel::store

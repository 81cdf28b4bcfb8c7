// Small text files, read and written whole.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::store {

/// Errors: not there, a folder, not readable, larger than `max_bytes`.
[[nodiscard]] Result<std::string> ReadTextFile(const std::filesystem::path& path,
                                               std::size_t max_bytes);

/// Writes beside the target and renames, so that nobody ever sees half a file.
/// Errors: not writable, disk full.
[[nodiscard]] Result<void> WriteTextFile(const std::filesystem::path& path, std::string_view text);

}  // namespace trammel::store

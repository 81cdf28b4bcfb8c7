// Reads whole files, with a limit of size.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace trammel::files {

/// Errors: missing, a folder, not readable, larger than `max_bytes`.
[[nodiscard]] Result<std::string> ReadWholeFile(const std::filesystem::path& path,
                                                std::size_t max_bytes);

/// Reads a file that another file names, or that is searched beside one: never a pipe or a device,
/// which could block forever.
[[nodiscard]] Result<std::string> ReadNamedFile(const std::filesystem::path& path,
                                                std::size_t max_bytes);

}  // namespace trammel::files

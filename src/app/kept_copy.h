// Whether a file was measured before, by the copies that recordings keep.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::app {

/// The recording among those of a folder that keeps the same bytes under one of the names; empty:
/// none. Errors (kInput): the folder cannot be read.
[[nodiscard]] Result<std::filesystem::path> FindKeptCopy(const std::filesystem::path& recordings,
                                                         std::span<const std::string> names,
                                                         std::string_view bytes);

}  // namespace trammel::app

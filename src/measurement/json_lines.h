// Files of JSON lines, which only grow, read line by line within bounds.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string_view>

#include "base/result.h"

namespace trammel::files {

/// The longest line that is read.
inline constexpr std::size_t kMostLineBytes = std::size_t{1} << 20;

/// Visits each line that is neither empty nor longer than kMostLineBytes. A last line without a
/// line feed counts. Errors (kInput): not there, not an ordinary file, not readable.
[[nodiscard]] Result<void> ForEachLine(const std::filesystem::path& path,
                                       const std::function<void(std::string_view line)>& visit);

}  // namespace trammel::files

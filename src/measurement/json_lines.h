// Files of JSON lines, which only grow, read line by line within bounds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>

#include "base/result.h"

namespace trammel::files {

/// The longest line that is read.
inline constexpr std::size_t kMostLineBytes = std::size_t{1} << 20;

/// How far a file was read.
struct LinesRead {
  std::size_t bytes = 0;
  std::size_t ended = 0;  ///< lines that a line feed ended
};

/// Takes a line and its number from 1; absent: longer than kMostLineBytes.
using TakeLine = std::function<void(std::optional<std::string_view>, std::size_t)>;

/// Hands over each line that is not empty, from where an earlier reading ended. A last line
/// without a line feed counts. Errors (kInput): not there, not an ordinary file, not readable.
[[nodiscard]] Result<LinesRead> ForEachLine(const std::filesystem::path& path, LinesRead from,
                                            const TakeLine& take);

/// 64-bit FNV-1a.
[[nodiscard]] std::uint64_t Fnv1a(std::string_view text);

}  // namespace trammel::files

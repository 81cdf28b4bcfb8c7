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

/// 64-bit FNV-1a of what stands before, and then of `text`.
inline constexpr std::uint64_t kFnv1aOfNothing = 14695981039346656037U;
[[nodiscard]] std::uint64_t Fnv1a(std::string_view text, std::uint64_t before = kFnv1aOfNothing);

/// How far a file was read: up to the end of the last line that a line feed ended. What stands
/// behind that may be half of a line that somebody writes.
struct LinesRead {
  std::size_t bytes = 0;
  std::size_t ended = 0;                 ///< lines
  std::uint64_t hash = kFnv1aOfNothing;  ///< Fnv1a of these bytes

  bool operator==(const LinesRead&) const = default;
};

/// A line of a file.
struct Line {
  std::optional<std::string_view> text = {};  ///< absent: longer than kMostLineBytes
  std::size_t number = 1;                     ///< from 1
  bool ended = true;                          ///< by a line feed; else the last one
};

/// Hands over each line that is not empty, from where an earlier reading ended, and reads what
/// stands before that again: absent where it is not what the earlier reading read, however far
/// before its end it was changed, and then no line was handed over. A last line without a line feed
/// counts. Errors (kInput): not there, not an ordinary file, not readable.
/// Cost: about 1 ms per MB.
[[nodiscard]] Result<std::optional<LinesRead>> ForEachLineSince(
    const std::filesystem::path& path, LinesRead from,
    const std::function<void(const Line& line)>& take);

/// Takes a line and its number from 1; absent: longer than kMostLineBytes.
using TakeLine = std::function<void(std::optional<std::string_view>, std::size_t)>;

/// Hands over each line that is not empty. Otherwise as ForEachLineSince.
[[nodiscard]] Result<void> ForEachLine(const std::filesystem::path& path, const TakeLine& take);

}  // namespace trammel::files

// "Did you mean …?"
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace trammel::files {

/// The known word that takes the fewest single-letter edits, if it is near enough to be meant:
/// at most one edit per three letters.
[[nodiscard]] std::optional<std::string_view> Nearest(std::string_view word,
                                                      std::span<const std::string_view> known);

}  // namespace trammel::files

// Text from outside, made fit to be drawn and shown.
#pragma once

#include <string>
#include <string_view>

namespace trammel::report {

/// The text with every byte that is not part of valid UTF-8, and every control character but line
/// feed and tab, replaced by U+FFFD.
[[nodiscard]] std::string Utf8OrReplaced(std::string_view text);

}  // namespace trammel::report

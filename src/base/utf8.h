// Sanitises text from outside for storage, drawing and display.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace trammel {

/// Replaces every byte that is not part of valid UTF-8, and every control character except line
/// feed and tab, by U+FFFD: for incoming text.
[[nodiscard]] std::string Utf8OrReplaced(std::string_view text);

/// Does the same, and cuts text longer than `most_bytes` after a whole character, with an ellipsis.
[[nodiscard]] std::string Utf8OrReplaced(std::string_view text, std::size_t max_bytes);

/// Escapes control characters (except line feed and tab), line separators and characters that
/// change the writing direction as \uXXXX: a terminal does not obey them and JSON reads the same
/// character. Bytes that are not UTF-8 become U+FFFD. For outgoing text.
[[nodiscard]] std::string EscapedForTerminal(std::string_view text);

/// Converts a text file's bytes to UTF-8: UTF-16 of either byte order, recognised by its byte order
/// mark (spreadsheets' "Unicode text"), is converted, half a character becomes U+FFFD, and UTF-8's
/// mark is removed. Other bytes are unchanged.
[[nodiscard]] std::string Utf8OfFile(std::string bytes);

/// Returns the number of bytes of an incomplete character at the end of the text; at most three.
[[nodiscard]] std::size_t IncompleteUtf8(std::string_view text);

}  // namespace trammel

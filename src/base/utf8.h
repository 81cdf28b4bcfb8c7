// Text from outside, made fit to be kept, drawn and shown.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace trammel {

/// The text with every byte that is not part of valid UTF-8, and every control character but line
/// feed and tab, replaced by U+FFFD: for text where it enters.
[[nodiscard]] std::string Utf8OrReplaced(std::string_view text);

/// The same, cut behind a whole character, with an ellipsis, where it is longer than `most_bytes`.
[[nodiscard]] std::string Utf8OrReplaced(std::string_view text, std::size_t most_bytes);

/// The text with control characters (all but line feed and tab), line separators and characters
/// that turn the direction of writing shown as \uXXXX, which a terminal does not obey and JSON
/// reads as the same character; bytes that are not UTF-8 become U+FFFD: for text where it leaves.
[[nodiscard]] std::string EscapedForTerminal(std::string_view text);

/// A text file's bytes as UTF-8: UTF-16 of either byte order, which its mark at the begin tells
/// (spreadsheets' "Unicode text"), is converted, half a character becomes U+FFFD, and the mark of
/// UTF-8 is taken off. Other bytes stay as they are.
[[nodiscard]] std::string Utf8OfFile(std::string bytes);

/// Bytes at the end of the text that begin a character and do not complete it; up to three.
[[nodiscard]] std::size_t IncompleteUtf8(std::string_view text);

}  // namespace trammel

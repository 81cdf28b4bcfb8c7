// Detects a file's kind by its first bytes, whatever its extension.
#pragma once

#include <optional>
#include <string_view>

namespace trammel {

struct FileKind {
  std::string_view name;    ///< with article: "a ZIP archive"
  std::string_view remedy;  ///< advice if a text or another format was expected: "unpack it, ..."
  bool is_archive = false;  ///< other files are in it
};

/// Returns the kind of a file that none of trammel's text readers accepts: archives, pictures,
/// documents, programs, web pages, text in UTF-16. Absent if the bytes may be such a text.
/// @param bytes  the file, or its first 64 bytes
[[nodiscard]] std::optional<FileKind> KindByContent(std::string_view bytes);

}  // namespace trammel

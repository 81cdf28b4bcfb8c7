// Names a file's kind by its first bytes, whatever its name ends in.
#pragma once

#include <optional>
#include <string_view>

namespace trammel {

struct FileKind {
  std::string_view name;    ///< with its article: "a ZIP archive"
  std::string_view remedy;  ///< where a text or another format was wanted: "unpack it, ..."
  bool is_archive = false;  ///< other files are in it
};

/// The kind of a file that no reader of trammel's own texts takes: archives, pictures, documents,
/// programs, web pages, text in UTF-16. Absent where the bytes may be such a text.
/// @param bytes  the file, or its first 64 bytes
[[nodiscard]] std::optional<FileKind> KindByContent(std::string_view bytes);

}  // namespace trammel

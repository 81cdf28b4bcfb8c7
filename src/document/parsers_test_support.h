// Parsers that judge what the documents write.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trammel::report::test {

/// Why the text is no well-formed XML (elements that do not close, loose < or &, bytes that are not
/// UTF-8); empty where it is. HTML's void elements must be closed too.
[[nodiscard]] std::string XmlProblem(std::string_view text);

struct PictureSize {
  int width = 0;
  int height = 0;
};

/// Decodes a PNG with Cairo; nothing where it is none.
[[nodiscard]] std::optional<PictureSize> DecodePng(std::string_view png);

}  // namespace trammel::report::test

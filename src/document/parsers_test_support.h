// Parsers that judge what the documents write.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trammel::report::test {

/// Returns why the text is not well-formed XML (unclosed elements, loose < or &, bytes that are not
/// UTF-8); empty if it is. HTML's void elements must be closed too.
[[nodiscard]] std::string XmlProblem(std::string_view text);

struct PictureSize {
  int width = 0;
  int height = 0;
};

/// Decodes a PNG with Cairo; nothing where it is none.
[[nodiscard]] std::optional<PictureSize> DecodePng(std::string_view png);

}  // namespace trammel::report::test

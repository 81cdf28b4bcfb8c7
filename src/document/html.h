// Pieces of HTML that cannot be broken by what is put into them.
#pragma once

#include <string>
#include <string_view>

namespace trammel::report {

/// For text and for quoted attributes: & < > " ' become references, bytes that are not UTF-8 and
/// control characters U+FFFD.
[[nodiscard]] std::string EscapeHtml(std::string_view text);

/// RFC 4648 with padding.
[[nodiscard]] std::string Base64(std::string_view bytes);

}  // namespace trammel::report

// Makes Cairo's SVG repeatable.
#pragma once

#include <string>
#include <string_view>

namespace trammel::report {

/// Cairo numbers some elements by a counter of the whole process, so that the same drawing differs
/// from one call to the next. Here every id that ends in a number is numbered anew in the order of
/// its first mention, with its references.
[[nodiscard]] std::string RenumberSvgIds(std::string_view svg);

}  // namespace trammel::report

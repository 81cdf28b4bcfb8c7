// {name} in the user's own G-code.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::gcode {

struct Placeholder {
  std::string name;   ///< without braces
  std::string value;  ///< what stands in its place
};

/// Puts values for `{name}`; `{{` and `}}` stand for single braces. Values are not expanded again.
/// Errors: an unknown name (lists the known ones), a brace without its partner (says which line).
[[nodiscard]] Result<std::string> ExpandPlaceholders(std::string_view text,
                                                     std::span<const Placeholder> known);

}  // namespace trammel::gcode

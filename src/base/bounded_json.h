// Parses JSON from outside within bounds of size, depth and memory.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel {

/// What a text may ask for before it is refused.
struct JsonBounds {
  std::size_t most_bytes = std::size_t{128} << 20;  ///< of text
  /// Levels of objects and lists. Copying, comparing and writing a value takes stack for each.
  int most_levels = 64;
  /// Of memory for the values, as estimated while they come: `[[],[],…` takes some forty times the
  /// bytes of its text.
  std::size_t most_memory_bytes = std::size_t{512} << 20;
  /// Whether a key given twice in one object is an error; otherwise the last counts.
  bool unique_keys = false;
  /// Whether a text or a key may hold the character U+0000, at which other programs cut it.
  bool zeros = true;
};

/// Parses one value and ends as soon as a bound is passed, before memory is spent beyond it. Errors
/// (kInput) begin with `name` and name the bound that was passed, the kind of file that the text is
/// by its first bytes, or the line where it is no JSON: a number too large for a double, a byte of
/// zero.
[[nodiscard]] Result<nlohmann::json> ParseBoundedJson(std::string_view text,
                                                      const std::string& name,
                                                      const JsonBounds& bounds = {});

}  // namespace trammel

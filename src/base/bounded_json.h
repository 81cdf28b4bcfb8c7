// Parses JSON from outside with limits on size, depth and memory.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel {

/// Limits on a JSON text; beyond them it is refused.
struct JsonBounds {
  std::size_t max_bytes = std::size_t{128} << 20;  ///< of text
  /// Maximum nesting of objects and lists. Copying, comparing and writing a value uses stack for
  /// each level.
  int max_levels = 64;
  /// Memory for the values, estimated during parsing: `[[],[],…` takes some forty times the bytes
  /// of its text.
  std::size_t max_memory_bytes = std::size_t{512} << 20;
  /// True if a duplicate key in an object is an error; otherwise its last value counts.
  bool unique_keys = false;
  /// True if a text or a key may contain the character U+0000, at which other programs truncate it.
  bool zeros = true;
};

/// Parses one value and stops at the first limit exceeded, before memory is spent beyond it. Errors
/// (kInput) begin with `name` and state the limit exceeded, the file's kind by its first bytes, or
/// the line of the syntax error. A number too large for a double and a zero byte are syntax errors.
[[nodiscard]] Result<nlohmann::json> ParseBoundedJson(std::string_view text,
                                                      const std::string& name,
                                                      const JsonBounds& bounds = {});

}  // namespace trammel

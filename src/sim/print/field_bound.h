// Bounds of the fields of a configuration struct.
#pragma once

#include <fmt/format.h>

#include <initializer_list>

#include "base/result.h"

namespace trammel::sim {

struct FieldBound {
  const char* name;
  double value;
  double lo;
  double hi;
};

/// Error (kInput): names the first field that is outside its bounds, or not a number.
[[nodiscard]] inline Result<void> CheckBounds(const char* what,
                                              std::initializer_list<FieldBound> fields) {
  for (const FieldBound& field : fields) {
    if (!(field.value >= field.lo && field.value <= field.hi)) {
      return Fail(fmt::format("{} {} is {}; it must lie within {} … {}", what, field.name,
                              field.value, field.lo, field.hi));
    }
  }
  return {};
}

}  // namespace trammel::sim

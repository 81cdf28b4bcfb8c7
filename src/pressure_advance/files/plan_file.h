// *.plan.json, format 1 (docs/formats.md).
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::files {

/// JSON with a fixed order of keys; numbers in the shortest form that reads back as the same value.
[[nodiscard]] std::string FormatPlan(const pressure_advance::PatternPlan& plan);

/// Trusts nothing: types, bounds, that lines are as long as they say and lie on the bed.
/// Errors begin with `file` and name the key, the value and the bound.
[[nodiscard]] Result<pressure_advance::PatternPlan> ParsePlan(std::string_view text,
                                                              const std::string& file);

}  // namespace trammel::files

// A comparison with the control as JSON, format 1 (docs/formats.md).
#pragma once

#include <string>

#include "pressure_advance/response/improvement.h"

namespace trammel::report {

/// One JSON object, indented by two spaces, ending in a newline; keys in the order of
/// docs/formats.md. Value, uncertainty and interval are `null` unless the verdict is good.
[[nodiscard]] std::string ToJson(const pressure_advance::Improvement& improvement);

}  // namespace trammel::report

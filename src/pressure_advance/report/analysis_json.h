// A pressure-advance analysis as JSON, format 1 (docs/formats.md).
#pragma once

#include <optional>
#include <string>

#include "pressure_advance/profile/analysis.h"

namespace trammel::report {

/// One JSON object, indented by two spaces, ending in a newline; keys in the order of
/// docs/formats.md, so that equal analyses give equal bytes.
/// @param report_path  of the report that was written; absent: `null`.
/// Value, uncertainty and interval are `null` unless the verdict is good, and so is any number that
/// is not finite. Bytes that are not UTF-8 (in a hostile file name) become U+FFFD.
[[nodiscard]] std::string ToJson(const pressure_advance::Analysis& analysis,
                                 const std::optional<std::string>& report_path = std::nullopt);

}  // namespace trammel::report

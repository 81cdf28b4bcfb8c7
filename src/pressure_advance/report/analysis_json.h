// A pressure-advance analysis as JSON, format 1 (docs/formats.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "pressure_advance/profile/analysis.h"

namespace trammel::report {

/// One object with its keys in the order of docs/formats.md, so that equal analyses give equal
/// bytes.
/// @param report_path  of the report that was written; absent: `null`.
/// Value, uncertainty and interval are `null` unless the verdict is good, and so is any number that
/// is not finite.
[[nodiscard]] nlohmann::ordered_json JsonOf(
    const pressure_advance::Analysis& analysis,
    const std::optional<std::string>& report_path = std::nullopt);

}  // namespace trammel::report

// Writes a comparison of series of taps, as a table and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "tap/ensemble/comparison.h"

namespace trammel::report {

/// Returns a row for each series; names those that repeat better or worse than the first.
[[nodiscard]] std::string ComparisonText(std::span<const tap::SeriesScatter> series);

/// Returns a list of objects (docs/reference/formats.md).
[[nodiscard]] nlohmann::ordered_json JsonOf(std::span<const tap::SeriesScatter> series);

}  // namespace trammel::report

// Series of taps side by side, as a table and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "tap/ensemble/comparison.h"

namespace trammel::report {

/// A row a series; those that repeat better or worse than the first are named.
[[nodiscard]] std::string ComparisonText(std::span<const tap::SeriesScatter> series);

/// A list of objects (docs/reference/formats.md).
[[nodiscard]] nlohmann::ordered_json JsonOf(std::span<const tap::SeriesScatter> series);

}  // namespace trammel::report

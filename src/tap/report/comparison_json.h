// Two methods on the same taps, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "tap/ensemble/method_comparison.h"

namespace trammel::report {

/// One object (docs/formats.md). Numbers are null where nothing is told.
[[nodiscard]] nlohmann::ordered_json JsonOf(const tap::MethodComparison& comparison);

}  // namespace trammel::report

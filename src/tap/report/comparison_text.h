// Two methods on the same taps, in words and figures for a terminal.
#pragma once

#include <string>
#include <vector>

#include "tap/ensemble/method_comparison.h"

namespace trammel::report {

/// Sentences on what the comparison takes for granted; may be empty.
[[nodiscard]] std::vector<std::string> ComparisonNotices(const tap::MethodComparison& comparison);

/// Several lines, the conclusion first.
[[nodiscard]] std::string ComparisonText(const tap::MethodComparison& comparison);

}  // namespace trammel::report

// Two methods on the same taps: a figure and an HTML page.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "document/figure.h"
#include "tap/ensemble/method_comparison.h"

namespace trammel::report {

/// "compare": heights less the mean of their place, tap after tap, by both methods. Nothing without
/// taps that were compared.
[[nodiscard]] std::optional<Figure> ComparisonFigure(const tap::MethodComparison& comparison);

/// Stands alone: nothing is loaded from elsewhere.
/// @param files  Named at the top; may hold any bytes.
[[nodiscard]] std::string ComparisonReport(const tap::MethodComparison& comparison,
                                           const std::vector<std::string>& files);

}  // namespace trammel::report

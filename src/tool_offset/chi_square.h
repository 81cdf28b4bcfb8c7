// Whether differences are larger than chance makes them.
#pragma once

namespace trammel::tool_offset {

/// Probability that chi-square with `freedom` degrees exceeds the value (Wilson & Hilferty 1931;
/// right to 0.01 from one degree of freedom on). 1 without a degree of freedom.
[[nodiscard]] double ChiSquareTail(double value, int freedom);

}  // namespace trammel::tool_offset

// How large a sum of squares may be by chance.
#pragma once

namespace trammel {

/// Probability that chi-square with `freedom` degrees exceeds the value (of what is not above 0,
/// and without a degree of freedom: 1). Right to rounding.
[[nodiscard]] double ChiSquareTail(double value, int freedom);

/// The value that chi-square stays below with this probability. REQUIRES 0 < probability < 1 and
/// freedom > 0.
[[nodiscard]] double ChiSquareQuantile(double probability, int freedom);

}  // namespace trammel

// How large Student's t may be by chance.
#pragma once

namespace trammel {

/// Probability that |t| exceeds the value's magnitude: two-sided; 1 for no
/// number. Right to rounding.
/// REQUIRES freedom > 0 (need not be whole).
[[nodiscard]] double StudentTail(double value, double freedom);

/// The magnitude that |t| exceeds with this probability. REQUIRES 0 < probability < 1, freedom > 0.
[[nodiscard]] double StudentPoint(double probability, double freedom);

}  // namespace trammel

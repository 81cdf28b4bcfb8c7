// How large Student's t may be by chance.
#pragma once

namespace trammel {

/// The magnitude that |t| exceeds with this probability. REQUIRES 0 < probability < 1, freedom > 0.
[[nodiscard]] double StudentPoint(double probability, double freedom);

}  // namespace trammel

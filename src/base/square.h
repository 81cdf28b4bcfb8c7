// Square of a number.
#pragma once

namespace trammel {

[[nodiscard]] constexpr double Square(double x) { return x * x; }

}  // namespace trammel

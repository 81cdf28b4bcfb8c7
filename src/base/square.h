// The square of a number, said once.
#pragma once

namespace trammel {

[[nodiscard]] constexpr double Square(double x) { return x * x; }

}  // namespace trammel

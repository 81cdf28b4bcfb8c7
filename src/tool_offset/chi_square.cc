#include "tool_offset/chi_square.h"

#include <cmath>
#include <numbers>

namespace trammel::tool_offset {

double ChiSquareTail(double value, int freedom) {
  if (freedom < 1) return 1;
  const double spread = 2.0 / (9.0 * freedom);
  const double z = (std::cbrt(value / freedom) - (1 - spread)) / std::sqrt(spread);
  return std::erfc(z / std::numbers::sqrt2) / 2;
}

}  // namespace trammel::tool_offset

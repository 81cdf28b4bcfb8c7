// Grey values between pixels.
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/page.h"

namespace trammel::part_alignment {

/// Grey value between pixels. REQUIRES 0 <= x <= width - 1 and the same for y.
[[nodiscard]] inline double Between(const PageView& picture, double x, double y) {
  const int x0 = std::min(static_cast<int>(x), picture.width - 2);
  const int y0 = std::min(static_cast<int>(y), picture.height - 2);
  const double fx = x - x0;
  const double fy = y - y0;
  const std::uint8_t* p = picture.row(y0) + x0;
  const std::uint8_t* below = p + picture.stride;
  const double above_grey = p[0] + (p[1] - p[0]) * fx;
  const double below_grey = below[0] + (below[1] - below[0]) * fx;
  return above_grey + (below_grey - above_grey) * fy;
}

}  // namespace trammel::part_alignment

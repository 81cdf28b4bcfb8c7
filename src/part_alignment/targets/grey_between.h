// Grey values between pixels.
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/page.h"
#include "part_alignment/targets/four.h"

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

/// The same to the bit, of four places. REQUIRES a picture with the last pixel's place below 2^31.
[[nodiscard, gnu::always_inline]] inline FourDoubles Between(const PageView& picture,
                                                             const FourPlaces& at) {
  const FourInts last_column = FourInts{} + (picture.width - 2);
  const FourInts last_row = FourInts{} + (picture.height - 2);
  FourInts column = __builtin_convertvector(at.x, FourInts);
  FourInts row = __builtin_convertvector(at.y, FourInts);
  column = column < last_column ? column : last_column;
  row = row < last_row ? row : last_row;
  const FourDoubles fx = at.x - __builtin_convertvector(column, FourDoubles);
  const FourDoubles fy = at.y - __builtin_convertvector(row, FourDoubles);
  const FourInts offset = row * static_cast<std::int32_t>(picture.stride) + column;
  // Two pixels a number, the first in the lower byte.
  FourInts above{};
  FourInts below{};
  for (int k = 0; k < 4; ++k) {
    const std::uint8_t* p = picture.data + offset[k];
    above[k] = p[0] | p[1] << 8;
    p += picture.stride;
    below[k] = p[0] | p[1] << 8;
  }
  const FourInts left = above & 0xff;
  const FourInts left_below = below & 0xff;
  const FourInts change = (above >> 8) - left;
  const FourInts change_below = (below >> 8) - left_below;
  const FourDoubles above_grey = __builtin_convertvector(left, FourDoubles) +
                                 __builtin_convertvector(change, FourDoubles) * fx;
  const FourDoubles below_grey = __builtin_convertvector(left_below, FourDoubles) +
                                 __builtin_convertvector(change_below, FourDoubles) * fx;
  return above_grey + (below_grey - above_grey) * fy;
}

}  // namespace trammel::part_alignment

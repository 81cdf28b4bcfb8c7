// The first step of shade along a row or a column.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "base/page.h"
#include "part_alignment/targets/four.h"
#include "part_alignment/targets/soft_grey.h"

namespace trammel::part_alignment {

/// Pixels from a place to the first step outwards along a row or a column. The place is no closer
/// than two pixels to the border.
class StepFinder {
 public:
  StepFinder(const PageView& picture, bool dark, int least_step)
      : picture_(picture), sign_(dark ? 1 : -1), least_(least_step) {}

  /// -1 where there is none within `most` pixels or the picture.
  template <int kDx, int kDy>
  [[nodiscard, gnu::always_inline]] inline int To(int column, int row, int most) const {
    // Soft grey is had a pixel from the border, and the step looks a pixel ahead.
    const int left = kDx > 0   ? picture_.width - 1 - column
                     : kDx < 0 ? column
                     : kDy > 0 ? picture_.height - 1 - row
                               : row;
    const int room = std::min(most, left - 2);
    constexpr int kAhead_px = 1;  // soft grey feels a rim before it is reached
    const std::ptrdiff_t along = kDy * picture_.stride + kDx;
    const std::uint8_t* p = picture_.row(row) + column;
    // A step at place i, soft grey at i + 1 less that at i - 1: lines of soft grey across the way
    // at i + 2 … i - 2, weighted by (1, 2, 0, -2, -1).
    FourInts behind = Lines<kDx>(p - along, along);
    int i = 1;
    for (p += 3 * along; i + 3 <= room; i += 4, p += 4 * along) {
      const FourInts ahead = Lines<kDx>(p, along);
      const FourInts before = __builtin_shufflevector(behind, ahead, 1, 2, 3, 4);
      const FourInts after = __builtin_shufflevector(behind, ahead, 3, 4, 5, 6);
      const FourInts is_step = sign_ * (ahead - behind + 2 * (after - before)) >= least_;
      if (Any(is_step)) return i + kAhead_px + FirstOf(is_step);
      behind = ahead;
    }
    for (; i <= room; ++i, p += along) {
      const int step = Line<kDx>(p) - Line<kDx>(p - 4 * along) +
                       2 * (Line<kDx>(p - along) - Line<kDx>(p - 3 * along));
      if (sign_ * step >= least_) return i + kAhead_px;
    }
    return -1;
  }

 private:
  template <int kDx>
  [[nodiscard, gnu::always_inline]] inline int Line(const std::uint8_t* p) const {
    return SoftLine(p, kDx == 0 ? 1 : picture_.stride);
  }

  /// The lines of four places on the way.
  template <int kDx>
  [[nodiscard, gnu::always_inline]] inline FourInts Lines(const std::uint8_t* p,
                                                          std::ptrdiff_t along) const {
    if (kDx == 0) {
      FourInts pixels;  // four of each line, one more than are needed
      for (int k = 0; k < 4; ++k) pixels[k] = FourBytesAt(p + k * along - 1);
      return (pixels & 0xff) + 2 * (pixels >> 8 & 0xff) + (pixels >> 16 & 0xff);
    }
    if (kDx < 0) p -= 3;
    const FourInts lines = Wide(p - picture_.stride) + 2 * Wide(p) + Wide(p + picture_.stride);
    return kDx > 0 ? lines : __builtin_shufflevector(lines, lines, 3, 2, 1, 0);
  }

  [[gnu::always_inline]] static inline std::int32_t FourBytesAt(const std::uint8_t* p) {
    std::int32_t bytes = 0;
    std::memcpy(&bytes, p, sizeof(bytes));
    return bytes;
  }
  [[gnu::always_inline]] static inline FourInts Wide(const std::uint8_t* p) {
    return FourInts{p[0], p[1], p[2], p[3]};
  }

  const PageView& picture_;
  int sign_;
  int least_;
};

}  // namespace trammel::part_alignment

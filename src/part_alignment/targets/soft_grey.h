// Grey values with less noise, for what is too faint for single pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "base/page.h"
#include "part_alignment/targets/four.h"
#include "part_alignment/targets/two.h"

namespace trammel::part_alignment {

inline constexpr int kSoftUnit = 16;  ///< of a grey level, what soft grey is counted in
/// What is left of the pixels' noise in soft grey, and in the difference of two places 2 px apart.
inline constexpr double kSoftNoise = 0.375;
inline constexpr double kSoftStepNoise = 0.484;

/// A pixel and those `stride` before and after it, weighted by (1, 2, 1).
inline int SoftLine(const std::uint8_t* p, std::ptrdiff_t stride) {
  return p[-stride] + 2 * p[0] + p[stride];
}

/// The 3 x 3 pixels about one, weighted by (1, 2, 1) each way, in sixteenths of a grey level.
/// REQUIRES `p` to be no pixel of the border.
inline int SoftGrey(const std::uint8_t* p, std::ptrdiff_t stride) {
  return SoftLine(p - stride, 1) + 2 * SoftLine(p, 1) + SoftLine(p + stride, 1);
}

/// A picture as SoftGrey shows it, by the nearest pixel. REQUIRES the last pixel's place in memory
/// below 2^31 for four at a time.
class SoftPicture {
 public:
  explicit SoftPicture(const PageView& picture) : picture_(picture) {}
  [[nodiscard]] bool Has(double x, double y) const {
    return x >= 0.5 && y >= 0.5 && x < picture_.width - 1.5 && y < picture_.height - 1.5;
  }
  [[nodiscard]] bool Has(Two place) const { return Has(place[0], place[1]); }
  /// REQUIRES Has(place).
  [[nodiscard]] int At(Two place) const {
    const TwoInts pixel = NearestPixel(place);
    return SoftGrey(picture_.row(pixel[1]) + pixel[0], picture_.stride);
  }
  /// Whether a pixel more to the right is there, too.
  [[nodiscard]] bool HasWide(Two place) const {
    return Has(place) && place[0] < picture_.width - 2.5;
  }
  /// Of four places, -1 where it has them.
  [[nodiscard, gnu::always_inline]] inline FourInts Has(const FourPlaces& at) const {
    const auto is_in = (at.x >= 0.5) & (at.y >= 0.5) & (at.x < picture_.width - 1.5) &
                       (at.y < picture_.height - 1.5);
    return __builtin_convertvector(is_in, FourInts);
  }
  /// Of four places; anything for those that it does not have.
  [[nodiscard, gnu::always_inline]] inline FourInts At(const FourPlaces& at) const {
    FourInts column = __builtin_convertvector(at.x + 0.5, FourInts);
    FourInts row = __builtin_convertvector(at.y + 0.5, FourInts);
    column = Least(Most(column, FourInts{} + 1), FourInts{} + (picture_.width - 2));
    row = Least(Most(row, FourInts{} + 1), FourInts{} + (picture_.height - 2));
    // Four pixels of a line are read, one more than are needed.
    if (Any(column == picture_.width - 2)) {
      FourInts grey{};
      for (int k = 0; k < 4; ++k) {
        grey[k] = SoftGrey(picture_.row(row[k]) + column[k], picture_.stride);
      }
      return grey;
    }
    return OfPixels(column, row);
  }
  /// REQUIRES HasWide(each of them).
  [[nodiscard, gnu::always_inline]] inline FourInts AtWide(const FourPlaces& at) const {
    return OfPixels(__builtin_convertvector(at.x + 0.5, FourInts),
                    __builtin_convertvector(at.y + 0.5, FourInts));
  }

 private:
  [[nodiscard, gnu::always_inline]] inline FourInts OfPixels(FourInts column, FourInts row) const {
    const FourInts offset = row * static_cast<std::int32_t>(picture_.stride) + column;
    const std::uint8_t* p = picture_.data - 1;
    const FourInts above = FourLines(p - picture_.stride, offset);
    const FourInts middle = FourLines(p, offset);
    const FourInts below = FourLines(p + picture_.stride, offset);
    const FourInts sides = Sides(above) + 2 * Sides(middle) + Sides(below);
    const FourInts own = Own(above) + 2 * Own(middle) + Own(below);
    return (sides & 0xffff) + (sides >> 16) + 2 * own;
  }

  /// Four pixels each from four offsets on, the first in the lowest byte.
  [[gnu::always_inline]] static inline FourInts FourLines(const std::uint8_t* p, FourInts offset) {
    FourInts lines;
    for (int k = 0; k < 4; ++k) {
      std::int32_t line = 0;
      std::memcpy(&line, p + offset[k], sizeof(line));
      lines[k] = line;
    }
    return lines;
  }
  /// The first and the third pixel, in 16 bits each; the second.
  [[gnu::always_inline]] static inline FourInts Sides(FourInts line) { return line & 0x00ff00ff; }
  [[gnu::always_inline]] static inline FourInts Own(FourInts line) { return line >> 8 & 0xff; }

  const PageView& picture_;
};

}  // namespace trammel::part_alignment

// Grey values with less noise, for what is too faint for single pixels.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/page.h"
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

/// A picture as SoftGrey shows it, by the nearest pixel.
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

 private:
  const PageView& picture_;
};

}  // namespace trammel::part_alignment

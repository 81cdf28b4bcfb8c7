// Where a JPEG lies in the larger one that it was cut from, as it says itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "base/frame.h"

namespace trammel::image {

/// All in px.
struct JpegPlace {
  int x = 0;  ///< of the cut picture's first pixel in the whole: a multiple of an MCU's width
  int y = 0;
  int whole_width = 0;
  int whole_height = 0;
};

/// The marker that bears the place: application data of a number that cameras leave alone.
inline constexpr int kPlaceMarker = 0xE9;
inline constexpr std::size_t kPlaceBytes = 21;

/// What stands behind the marker: "trammel part", 0, and four numbers of 16 bits.
/// REQUIRES numbers of 0 … 65535.
[[nodiscard]] std::array<std::uint8_t, kPlaceBytes> FormatPlace(const JpegPlace& place);

/// Absent where the bytes are another program's.
[[nodiscard]] std::optional<JpegPlace> ParsePlace(std::span<const std::uint8_t> bytes);

/// A picture's size and that of its MCUs, all in px.
struct JpegGrid {
  int width = 0;
  int height = 0;
  int mcu_width = 8;  ///< pixels that are coded together: 8 chroma samples
  int mcu_height = 8;

  [[nodiscard]] int chroma_width() const { return mcu_width / 8; }  ///< pixels of a sample
  [[nodiscard]] int chroma_height() const { return mcu_height / 8; }
};

/// Whether a picture can lie there: within the whole, and cut from it along MCUs.
[[nodiscard]] bool Fits(const JpegPlace& place, const JpegGrid& cut);

/// Pixels of the whole that a cut picture has to the bit: on each side that is none of the whole's
/// one chroma sample less than it holds, since a decoder interpolates chroma between neighbours.
/// REQUIRES Fits().
[[nodiscard]] PixelRect ExactPart(const JpegPlace& place, const JpegGrid& cut);

/// The fewest MCUs of a picture in which `part` is exact. REQUIRES `part` within the picture.
[[nodiscard]] PixelRect CutAround(const PixelRect& part, const JpegGrid& whole);

}  // namespace trammel::image

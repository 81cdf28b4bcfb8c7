// The page at about 100 dpi: small enough to look at every pixel of it for the sheet.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/reading/page.h"

namespace trammel::tool_offset {

/// Means over blocks of factor x factor pixels, and how far each differs from its surroundings.
struct SmallPage {
  int factor = 1;  ///< px of the page per small pixel
  int width = 0;   ///< small pixels
  int height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;      ///< interleaved, shape (height, width, channels)
  std::vector<std::uint8_t> background;  ///< the same shape: median of the surroundings
  /// Distance from the background in colour, whichever way: dark on light, light on dark, or of
  /// another hue. 0 … 255.
  std::vector<std::uint8_t> strength;

  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  /// Where a place among the small pixels lies on the page.
  [[nodiscard]] PagePoint OnPage(double x, double y) const {
    return {(x + 0.5) * factor - 0.5, (y + 0.5) * factor - 0.5};
  }
};

/// Shrinks so that the longer side has at most about 1200 small pixels (A4 at 100 dpi).
/// Cost: reads at most every second pixel of large pages, on all processors.
[[nodiscard]] SmallPage Shrink(const PageView& page);

}  // namespace trammel::tool_offset

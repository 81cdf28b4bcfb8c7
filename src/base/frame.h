// Image with its capture time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/check.h"

namespace trammel {

/// Read-only view of 8-bit BGR pixels, row-major. Does not own them.
struct BgrView {
  const std::uint8_t* data = nullptr;
  int width = 0;              ///< px
  int height = 0;             ///< px
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next, >= 3 * width

  [[nodiscard]] const std::uint8_t* row(int y) const { return data + y * stride; }
};

/// Rectangle of whole pixels; (x, y) is its first pixel.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// True if `inner` is completely within `outer`.
[[nodiscard]] inline bool Contains(const PixelRect& outer, const PixelRect& inner) {
  return inner.x >= outer.x && inner.y >= outer.y &&
         inner.x + inner.width <= outer.x + outer.width &&
         inner.y + inner.height <= outer.y + outer.height;
}

/// Owned 8-bit BGR image, shape (height, width, 3), row-major, without padding, with its capture
/// time on the source's clock.
struct Frame {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> bgr;
  std::optional<double> time_s;  ///< absent where the source does not say

  Frame() = default;
  Frame(int width_px, int height_px)
      : width(width_px),
        height(height_px),
        bgr(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3) {}

  [[nodiscard]] BgrView view() const {
    return {bgr.data(), width, height, std::ptrdiff_t{3} * width};
  }
  [[nodiscard]] std::uint8_t* row(int y) {
    return bgr.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width) * 3;
  }
};

/// Returns part of a view. REQUIRES rect within the view.
[[nodiscard]] inline BgrView Crop(const BgrView& view, const PixelRect& rect) {
  TRAMMEL_CHECK(rect.x >= 0 && rect.y >= 0 && rect.width > 0 && rect.height > 0 &&
                    rect.x <= view.width - rect.width && rect.y <= view.height - rect.height,
                "crop {}x{} at ({}, {}) of a {}x{} image", rect.width, rect.height, rect.x, rect.y,
                view.width, view.height);
  return {view.row(rect.y) + std::ptrdiff_t{3} * rect.x, rect.width, rect.height, view.stride};
}

}  // namespace trammel

// Float images and points of a picture, shared by the vision pieces.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/check.h"

namespace trammel::vision {

/// A point of a picture; (0, 0) is the centre of the first pixel, x right, y down.
struct PointPx {
  double x = 0;
  double y = 0;
};

/// Four corners in order along the outline.
using Quad = std::array<PointPx, 4>;

/// One brightness per pixel, shape (height, width), row-major.
struct GrayImage {
  int width = 0;
  int height = 0;
  std::vector<float> value;

  GrayImage() = default;
  GrayImage(int width_px, int height_px)
      : width(width_px),
        height(height_px),
        value(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {
    TRAMMEL_CHECK(width_px >= 0 && height_px >= 0, "{} x {}", width_px, height_px);
  }

  [[nodiscard]] const float* row(int y) const {
    return value.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
  [[nodiscard]] float* row(int y) {
    return value.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
};

}  // namespace trammel::vision

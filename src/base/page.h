// A scanned page.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace trammel {

/// Read-only view of 8-bit pixels, row-major, grey or BGR interleaved. Does not own them.
struct PageView {
  const std::uint8_t* data = nullptr;
  int width = 0;              ///< px
  int height = 0;             ///< px
  int channels = 1;           ///< 1 or 3
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next, >= channels * width

  [[nodiscard]] const std::uint8_t* row(int y) const { return data + y * stride; }
};

/// Owned page and the resolution that its file states.
struct Page {
  int width = 0;
  int height = 0;
  int channels = 1;  ///< 1 or 3
  std::vector<std::uint8_t> samples;
  std::optional<double> dpi_x;  ///< along a row; absent where the file does not say; may be wrong
  std::optional<double> dpi_y;
  /// Focal length of a camera's picture as for 35 mm film (36 x 24 mm), in mm; absent if the file
  /// has none, like a scan's.
  std::optional<int> film_focal_mm = {};

  [[nodiscard]] std::ptrdiff_t stride() const { return std::ptrdiff_t{channels} * width; }
  [[nodiscard]] std::uint8_t* row(int y) { return samples.data() + y * stride(); }
  [[nodiscard]] PageView view() const {
    return {samples.data(), width, height, channels, stride()};
  }
};

}  // namespace trammel

// The scanned page as it was decoded, and how parts of it are sampled: never copied as a whole.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"

namespace trammel::tool_offset {

/// A read-only window into a decoded page. Does not own it. 8-bit grey or BGR, row-major.
struct PageView {
  const std::uint8_t* data = nullptr;
  int width = 0;              ///< px
  int height = 0;             ///< px
  int channels = 1;           ///< 1 (grey) or 3 (blue, green, red side by side)
  std::ptrdiff_t stride = 0;  ///< bytes from one row to the next, >= channels * width
  /// What the file or the user says, in dots per inch; only compared with what the box says.
  std::optional<double> dpi_x;
  std::optional<double> dpi_y;

  [[nodiscard]] const std::uint8_t* row(int y) const { return data + y * stride; }
};

/// Names what is wrong with a page that cannot be one.
[[nodiscard]] Result<void> CheckPage(const PageView& page);

/// A place on the page; (0, 0) is the centre of the first pixel, y runs down.
struct PagePoint {
  double x_px = 0;
  double y_px = 0;

  friend PagePoint operator+(PagePoint a, PagePoint b) {
    return {a.x_px + b.x_px, a.y_px + b.y_px};
  }
  friend PagePoint operator-(PagePoint a, PagePoint b) {
    return {a.x_px - b.x_px, a.y_px - b.y_px};
  }
  friend PagePoint operator*(double k, PagePoint a) { return {k * a.x_px, k * a.y_px}; }
};

[[nodiscard]] double Length(PagePoint a);

/// One number per pixel: the weighted sum of its channels. Grey pages use the first weight only.
using ChannelMix = std::array<float, 3>;

/// A grid of places on the page: row r, column c lies at origin + r * row_step + c * column_step.
struct Strip {
  PagePoint origin;
  PagePoint row_step;
  PagePoint column_step;
  int rows = 0;
  int columns = 0;
};

/// Samples the mix at every place of the strip, linearly between pixels (which keeps areas and
/// first moments, and is as even-handed to the left as to the right).
/// @param out  rows * columns values, row by row; resized.
/// @returns false, and leaves `out` as it was, where a part of the strip lies beside the page.
[[nodiscard]] bool SampleStrip(const PageView& page, const ChannelMix& mix, const Strip& strip,
                               std::vector<float>& out);

}  // namespace trammel::tool_offset

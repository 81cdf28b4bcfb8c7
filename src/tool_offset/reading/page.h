// Places on a scanned page, and how parts of it are sampled: it is never copied as a whole.
#pragma once

#include <array>
#include <vector>

#include "base/page.h"
#include "base/result.h"

namespace trammel::tool_offset {

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

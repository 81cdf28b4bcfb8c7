// Measures and reduces a picture's noise, and interpolates grey values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/page.h"

namespace trammel::part_alignment {

/// Estimates the standard deviation of a pixel's noise, grey levels, from the median of |I(x + 1) -
/// I(x - 1)| over some rows. Edges hardly count if most of the picture is plain; a busy picture
/// yields more.
/// @param picture  1 channel, at least 16 x 16 px.
[[nodiscard]] double PixelNoise(const PageView& picture);

/// Noise in grey levels above which a picture is smoothed first.
inline constexpr double kNoisy = 2.4;

/// Factor by which Quieten reduces white noise.
inline constexpr double kQuietNoise = 0.375;

/// Smooths with binomial weights (1, 2, 1) / 4 along both axes: an edge's blur gains 0.5 px² of
/// variance.
/// @param samples  receives width x height values.
/// @returns the picture in `samples`.
PageView Quieten(const PageView& picture, std::vector<std::uint8_t>& samples);

/// Smooths the 3 x 3 pixels about one in the same way, in sixteenths of a grey level and not
/// rounded. REQUIRES `p` to be no pixel of the border.
[[nodiscard]] inline int SoftGrey(const std::uint8_t* p, std::ptrdiff_t stride) {
  const auto line = [](const std::uint8_t* q) { return q[-1] + 2 * q[0] + q[1]; };
  return line(p - stride) + 2 * line(p) + line(p + stride);
}
inline constexpr int kSoftUnit = 16;

/// Interpolates the grey value between pixels. REQUIRES 0 <= x <= width - 1 and the same for y.
[[nodiscard]] inline double Between(const PageView& picture, double x, double y) {
  const int x0 = std::min(static_cast<int>(x), picture.width - 2);
  const int y0 = std::min(static_cast<int>(y), picture.height - 2);
  const double fx = x - x0;
  const double fy = y - y0;
  const std::uint8_t* p = picture.row(y0) + x0;
  const std::uint8_t* below = p + picture.stride;
  const double above_grey = p[0] + (p[1] - p[0]) * fx;
  const double below_grey = below[0] + (below[1] - below[0]) * fx;
  return above_grey + (below_grey - above_grey) * fy;
}

}  // namespace trammel::part_alignment

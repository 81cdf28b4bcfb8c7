// Finds rectangles on a small copy of the page.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/reading/page.h"

namespace trammel::tool_offset {

/// Means over blocks of factor x factor pixels, and each one's difference from its surroundings.
struct SmallPage {
  int factor = 1;  ///< px of the page per small pixel
  int width = 0;   ///< small pixels
  int height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;      ///< interleaved, shape (height, width, channels)
  std::vector<std::uint8_t> background;  ///< the same shape: median of the surroundings
  /// Colour distance from the background, of either sign: dark on light, light on dark, or of
  /// another hue. 0 … 255.
  std::vector<std::uint8_t> strength;

  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  /// Converts a position among the small pixels to the page.
  [[nodiscard]] PagePoint OnPage(double x, double y) const {
    return {(x + 0.5) * factor - 0.5, (y + 0.5) * factor - 0.5};
  }
};

/// Shrinks the page so that the longer side has at most about 1200 small pixels (A4 at 100 dpi).
/// Cost: reads at most every second pixel of large pages, on all processors.
[[nodiscard]] SmallPage Shrink(const PageView& page);

/// Corners of the smallest rectangle around one connected piece of ink, at any angle, moved onto
/// the piece itself.
struct BoxCandidate {
  /// Corners in order around the piece, small pixels. Sides run from corner i to corner i + 1.
  std::array<PagePoint, 4> corners;
  /// Inked part of each side; 1 for a line without a gap.
  std::array<double, 4> support{};
  /// True if the corners come from lines through most of each side's pixels, because the piece
  /// itself is no rectangle.
  bool straightened = false;

  /// Returns the lengths of sides 0 and 1, small pixels.
  [[nodiscard]] double length() const { return Length(corners[1] - corners[0]); }
  [[nodiscard]] double width() const { return Length(corners[2] - corners[1]); }
  /// Counts the sides with ink along nearly all of them.
  [[nodiscard]] int sides() const;
};

/// Finds every large connected piece whose strength reaches `threshold`, largest rectangle first.
/// @param widened  joins pieces separated by a pixel or two: broken lines of a box.
[[nodiscard]] std::vector<BoxCandidate> FindBoxCandidates(const SmallPage& page, int threshold,
                                                          bool widened);

/// True if the middle of one is in the other: nested lines of one box, not two sheets.
[[nodiscard]] bool Overlap(const BoxCandidate& a, const BoxCandidate& b);

}  // namespace trammel::tool_offset

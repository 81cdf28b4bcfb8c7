// Closed rectangles of lines on the small page: where the sheet's box may be.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/reading/small_page.h"

namespace trammel::tool_offset {

/// The corners of the smallest rectangle around one connected piece of ink, at any angle, put on
/// the piece itself.
struct BoxCandidate {
  /// In order around the piece, small pixels. Sides run from corner i to corner i + 1.
  std::array<PagePoint, 4> corners;
  /// Which part of each side has ink on it; 1 for a line without a gap.
  std::array<double, 4> support{};
  /// Whether lines through most of each side's pixels gave the corners, because the piece itself is
  /// no rectangle.
  bool straightened = false;

  /// Of sides 0 and 1, small pixels.
  [[nodiscard]] double length() const { return Length(corners[1] - corners[0]); }
  [[nodiscard]] double width() const { return Length(corners[2] - corners[1]); }
  /// How many of the four sides have ink along nearly all of them.
  [[nodiscard]] int sides() const;
};

/// Every large connected piece whose strength reaches `threshold`, largest rectangle first.
/// @param widened  joins pieces that a pixel or two parts: lines of a box that broke.
[[nodiscard]] std::vector<BoxCandidate> FindBoxCandidates(const SmallPage& page, int threshold,
                                                          bool widened);

/// Whether the middle of one lies in the other: nested lines of one box, not two sheets.
[[nodiscard]] bool Overlap(const BoxCandidate& a, const BoxCandidate& b);

}  // namespace trammel::tool_offset

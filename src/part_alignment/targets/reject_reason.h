// Why what looks like a target was not read.
#pragma once

#include <string_view>

namespace trammel::part_alignment {

enum class RejectReason {
  kMirrored,   ///< not in the book, but its mirror image is: see FinderOptions::mirrored
  kWrongCode,  ///< a clear ring, but its word is not in the book
  kDoubled,    ///< read at two places; both are rejected
  kHidden,     ///< parts of the ring are covered, or not of one of two shades
  kAtBorder,   ///< the picture ends within the ring
  kTooSmall,   ///< disc below min_radius_px
  kSaturated,  ///< too few samples between black and white to place the edge
  kDamaged,    ///< the disc is no clean ellipse
  kFaint,      ///< a ring about a disc of less than min_contrast
  kUneven,     ///< a ring, but light that differs across it by more than can be corrected
};

/// "wrong_code" and so on.
[[nodiscard]] std::string_view ToString(RejectReason reason);

}  // namespace trammel::part_alignment

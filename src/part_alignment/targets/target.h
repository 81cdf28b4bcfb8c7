// Targets: their layout, those found in a picture, and reasons why others were not read.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// Radii in Schneider's layout: a disc, a ring of as many equal segments as the code has bits, and
/// nothing else. Segment k spans the angles 2 pi k / bits … 2 pi (k + 1) / bits, clockwise from the
/// right as seen in front of the target, and is inked if bit k of the word is 1.
inline constexpr double kRingInner = 2.0;  ///< radius of the ring's inner edge
inline constexpr double kRingOuter = 3.0;  ///< radius of its outer edge
/// Radius within which only disc and ring may be visible.
inline constexpr double kQuietRadius = 3.75;

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

/// "its ring is read well, but its code is none of this book's: another --bits, or no target".
[[nodiscard]] std::string WordsFor(RejectReason reason);

struct FoundTarget {
  std::optional<int> number;  ///< in the code book, from 1; absent for a plain disc
  /// Image of the disc. In an oblique view its centre is not the image of the disc's centre: see
  /// eccentricity.h.
  ImageEllipse disc;
  double sigma_column_px = 0;  ///< k = 1, from the pixels' own scatter about the model
  double sigma_row_px = 0;
  double contrast = 0;         ///< grey levels, disc less surroundings: negative for dark discs
  double noise = 0;            ///< scatter of the pixels about the model, grey levels
  double blur_px = 0;          ///< standard deviation of the edge's profile
  double saturated_share = 0;  ///< share of samples, 0 … 1
};

struct RejectedTarget {
  RejectReason reason = RejectReason::kWrongCode;
  double column_px = 0;
  double row_px = 0;
  double radius_px = 0;
  std::optional<int> number;  ///< if read
};

struct FoundTargets {
  std::vector<FoundTarget> targets;      ///< ascending by number, then from the top
  std::vector<RejectedTarget> rejected;  ///< top to bottom
};

}  // namespace trammel::part_alignment

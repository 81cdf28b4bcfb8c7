// Finds the printed mark and the comb of a photo.
#pragma once

#include <optional>

#include "base/frame.h"
#include "vision/comb_finder.h"
#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {

/// The corner of a rectified picture in which the frame is filled: that of the first line's start.
struct MarkedCorner {
  bool bottom = false;
  bool right = false;
};

/// Looks between the outer lines and the bars beyond them, at both ends of the lines, for the one
/// corner that is filled before its bar while the line's other end is plate there. The mark's
/// strokes may lie apart, as a starved printer lays them. A string or a blob is narrower than what
/// is asked of a mark: all of a tenth of the line, one and a half beads deep.
/// @param contrast  filament higher than plate.
/// @returns nothing where no corner stands out, or more than one.
[[nodiscard]] std::optional<MarkedCorner> FindMark(const vision::GrayImage& contrast,
                                                   const vision::LinePattern& line_pattern);

/// Longer sides of what is seen from above are shrunk to this.
inline constexpr double kLongestRectified_px = 3000;

/// The lines and some plate around them.
struct CombView {
  vision::Quad corners;  ///< in px of the photo; top left, top right, bottom right, bottom left
  Frame picture;         ///< straight from above, lines along the rows; never mirrored
  vision::GrayImage contrast;        ///< same size: filament higher than plate
  vision::LinePattern line_pattern;  ///< in px of `picture`
};

/// Looks at a comb straight from above and traces its lines.
/// @param longest_px  to which its longer side is shrunk
/// @returns nothing where it is too small, or filament and plate look alike.
[[nodiscard]] std::optional<CombView> LookAtComb(const BgrView& photo,
                                                 const vision::FoundComb& comb, double longest_px);

}  // namespace trammel::pressure_advance

// Finds the printed mark and the comb of a photo.
#pragma once

#include <optional>

#include "base/frame.h"
#include "vision/comb_finder.h"
#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {

/// Corner of a rectified picture in which the frame is filled: that of the first line's start.
struct MarkedCorner {
  bool bottom = false;
  bool right = false;
};

/// Finds the one corner that is filled before its bar, with plate at the line's other end. Searches
/// between the outer lines and the bars beyond them, at both ends of the lines. The mark's strokes
/// may be separate, as a starved printer lays them. A string or a blob is narrower than the
/// required extent of a mark: a tenth of the line's length, one and a half beads deep.
/// @param contrast  filament higher than plate.
/// @returns nothing if no corner stands out, or more than one.
[[nodiscard]] std::optional<MarkedCorner> FindMark(const vision::GrayImage& contrast,
                                                   const vision::LinePattern& line_pattern);

/// Maximum side length of a rectified picture.
inline constexpr double kLongestRectified_px = 3000;

/// Lines with some plate around them.
struct CombView {
  vision::Quad corners;  ///< in px of the photo; top left, top right, bottom right, bottom left
  Frame picture;         ///< straight from above, lines along the rows; never mirrored
  vision::GrayImage contrast;        ///< same size: filament higher than plate
  vision::LinePattern line_pattern;  ///< in px of `picture`
};

/// Rectifies a comb to a top view and traces its lines.
/// @param longest_px  maximum of its longer side after reduction
/// @param framed      as for TraceComb
/// @returns nothing if it is too small, or filament and plate look alike.
[[nodiscard]] std::optional<CombView> LookAtComb(const BgrView& photo,
                                                 const vision::FoundComb& comb, double longest_px,
                                                 bool framed);

}  // namespace trammel::pressure_advance

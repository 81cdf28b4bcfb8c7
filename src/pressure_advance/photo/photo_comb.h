// Equally spaced lines of a photo seen straight from above, without need of their frame.
#pragma once

#include <optional>

#include "base/frame.h"
#include "vision/comb_finder.h"
#include "vision/homography.h"
#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {

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

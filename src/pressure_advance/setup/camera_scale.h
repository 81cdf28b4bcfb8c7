// Scale and rotation of the camera, from a mark on the plate while the head moves in x and y.
#pragma once

#include <optional>
#include <span>

#include "base/measured.h"
#include "pressure_advance/setup/linear_fit.h"
#include "pressure_advance/setup/observations.h"

namespace trammel::pressure_advance {

/// Model: picture = origin + picture_from_bed · (mark - head), the columns of picture_from_bed
/// being px per mm of x and of y. A camera above the plate that is turned counter-clockwise by r
/// has scale · [cos r, sin r; sin r, -cos r]: the picture's rows count downwards.
struct CameraScale {
  Measured px_per_mm;
  Measured rotation_rad;  ///< counter-clockwise from above; 0: columns run along +x
  Measured play_x_mm;     ///< between the two directions of approach
  Measured play_y_mm;
  double repeat_mm = 0;  ///< rms of what places and pictures leave unexplained
  /// Values: column and row of the mark with the head at `middle`; d column, d row per mm of head
  /// motion in x, then y; play in x as pixels of column and row, then y.
  std::optional<LinearFit> fit;
  double middle_x_mm = 0;
  double middle_y_mm = 0;
};

/// Fits all values at once. Every Measured carries the same reason where there is none: too few
/// places, an axis that was not moved, a mount or belt that does not repeat, more play than can be
/// borne, a mirrored picture or an axis of the wrong sign, scales of the axes that differ.
/// @param marks  of one mark, all at one height; places some mm apart in both axes, each approached
///               from both sides.
/// @param height_uncertainty  relative standard uncertainty of the scale, of the height between the
///               plate and the bead's top at which the mark's edges are seen.
[[nodiscard]] CameraScale FitCameraScale(std::span<const SeenMark> marks, const SetupLimits& limits,
                                         double height_uncertainty = 0);

}  // namespace trammel::pressure_advance

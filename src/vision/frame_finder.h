// Finds the printed frame in a photo.
#pragma once

#include <vector>

#include "base/frame.h"
#include "vision/image.h"

namespace trammel::vision {

/// Quadrilateral outline of filament.
struct FoundFrame {
  Quad outer;          ///< outer corners in px of the photo, clockwise as seen
  double closed = 0;   ///< share of the worst side along which filament begins there, 0 … 1
  GrayImage filament;  ///< 1 where the shrunk picture shows filament, 0 elsewhere
  double filament_scale = 1;  ///< px of `filament` per px of the photo
};

/// Looks for connected pieces of filament whose outline is a convex quadrilateral, in several
/// colour channels, lighter and darker than their surroundings, at several smoothing scales: a
/// textured plate, uneven light or a string of filament spoils some of these but seldom all.
/// @param photo  8-bit BGR. REQUIRES at least 16 px each way.
/// @returns the ten best frames that are closed on all sides, closed and large ones first. Nothing
/// says that a frame holds lines.
[[nodiscard]] std::vector<FoundFrame> FindPrintedFrames(const BgrView& photo);

}  // namespace trammel::vision

// What a known lens does to a square marker.
#pragma once

#include <optional>

#include "part_alignment/camera/camera.h"
#include "part_alignment/targets/square_shape.h"

namespace trammel::part_alignment {

struct StraightenedSquare {
  ImagePoint centre;  ///< where the marker's middle is seen through the lens, px
  /// Of the most bent edge, beyond what the lens bends; > 0 outwards.
  double bow_px = 0;
};

/// A lens bends straight edges, and moves where the lines along them cross: by about 2 k1 a² R at a
/// distance R from the principal point, a being half the side. Here the lines are straightened
/// first. Exact but for what the lens bends more than quadratically over the marker.
/// Absent where the lens cannot be inverted. REQUIRES Validate(camera).
[[nodiscard]] std::optional<StraightenedSquare> Straighten(const Camera& camera,
                                                           const SquareShape& shape);

}  // namespace trammel::part_alignment

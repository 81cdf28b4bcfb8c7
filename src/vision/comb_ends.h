// Finds where the lines of a comb end.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::vision {

/// Line of a comb in a rectified picture.
struct CombLine {
  Curve track;   ///< y_px of the middle over x_px
  Columns seen;  ///< with the plate on both sides
};

struct CombEnds {
  std::optional<Curve> x_px;    ///< over y_px; absent: too few lines agree on one
  std::vector<bool> ends_here;  ///< per line
  std::size_t cut = 0;          ///< lines that leave the photo before any end
};

/// Finds the ends on one side as the straight row at which most lines cease to be brighter than the
/// spaces beside them: by ending on the plate, at a bar across them, or in a filled box. Breaks in
/// some lines do not count.
/// @param contrast   filament higher than plate.
/// @param direction  -1 for the left ends, 1 for the right.
/// REQUIRES pitch_px > bead_px > 0.
[[nodiscard]] CombEnds FindCombEnds(const GrayImage& contrast, std::span<const CombLine> lines,
                                    double pitch_px, double bead_px, int direction);

}  // namespace trammel::vision

// A disc's middle, by chords.
#pragma once

#include <optional>

#include "base/page.h"
#include "part_alignment/targets/row_runs.h"

namespace trammel::part_alignment {

/// Walks from the run's middle to the middle of what has its shade: the centre by chords, (column,
/// row), and the ellipse that chords in four directions are of. Absent where they are of none, or
/// of one that is smaller than a disc of `min_radius_px` or tilted by more than some 73 degrees.
/// The threshold lies between the shades of disc and surroundings; where a shadow's edge is near,
/// of the shaded ones.
/// @param run  an even one.
struct Middle {
  double column_px = 0;
  double row_px = 0;
  /// From the unit circle to the ellipse, symmetric: (xx, xy; xy, yy), px.
  double xx = 0;
  double xy = 0;
  double yy = 0;
  bool operator==(const Middle&) const = default;
};
[[nodiscard]] std::optional<Middle> WalkToMiddle(const PageView& picture, const Run& run,
                                                 double min_radius_px, double max_radius_px);

}  // namespace trammel::part_alignment

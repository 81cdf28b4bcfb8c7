// A disc's outline: its middle by chords, then the ellipse by rays.
#pragma once

#include <optional>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/row_runs.h"

namespace trammel::part_alignment {

/// Walks from the run's middle to the middle of what has its shade: the centre by chords, (column,
/// row), and the ellipse that chords in four directions are of. Absent where they are of none, or
/// of one that is smaller than a disc of `min_radius_px` or tilted by more than some 73 degrees.
struct Middle {
  double column_px = 0;
  double row_px = 0;
  /// From the unit circle to the ellipse, symmetric: (xx, xy; xy, yy), px.
  double xx = 0;
  double xy = 0;
  double yy = 0;
};
[[nodiscard]] std::optional<Middle> WalkToMiddle(const PageView& picture, const Run& run,
                                                 double min_radius_px, double max_radius_px);

/// The ellipse through where rays from the middle cross half the contrast, as a start for FitDisc.
/// Absent where they do not lie on one, or the contrast is less.
/// @param dark  whether the disc is darker than what is about it.
[[nodiscard]] std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle,
                                                 bool dark, double min_contrast);

}  // namespace trammel::part_alignment

// A relief seen at an angle from above.
#pragma once

#include <string>

#include "document/plot.h"

namespace trammel::report {

struct SurfaceAxes {
  std::string along;   ///< labels with units; columns run along …
  std::string across;  ///< … and rows across
  Range along_range;
  Range across_range;
  Range height_range;  ///< shown from the floor to full height; also the colours' range
};

/// Draws the grid as a surface, far cells first (painter's algorithm), coloured by height and
/// shaded by slope, with a floor and its axes. Cells with a NaN corner are left open. Parallel
/// projection: columns run to the right and slightly towards the viewer, rows away to the upper
/// right.
void DrawSurface(Canvas& canvas, const RectPx& outer, const Grid& grid, const SurfaceAxes& axes);

/// At most so many columns and rows, by the median of the finite values that a new cell covers and
/// of its direct neighbours: a relief shows speckle as spikes where a map shows it as grain.
[[nodiscard]] Grid Smoothed(const Grid& grid, std::size_t most_columns, std::size_t most_rows);

}  // namespace trammel::report

// Widths of printed lines, all along.
#pragma once

#include <vector>

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::vision {

/// Reading at one position of a line.
struct BeadReading {
  double x_px = 0;
  double centre_px = 0;  ///< y of the bead's middle (of its track where it is broken)
  double width_px = 0;   ///< about 0 where the filament broke; may fall below 0 by noise
  double sigma_px = 0;   ///< 1 sigma; 0 where nothing can be measured, and with a width above 0
                         ///< where the plate has no grain, as in a drawing
  bool seen = true;      ///< false beyond the photo's border
};

struct BeadWidths {
  std::vector<std::vector<BeadReading>> lines;  ///< per rung, per place along the line
  double blur_px = 0;  ///< sigma of the bead edges' blur, from their steepest slope
};

/// Integrates, across each line, the brightness above the plate's over that of the filament above
/// the plate's. A blurred edge does not change such an integral, and the texture of a plate adds to
/// it as noise without bias. Both levels are found locally: the plate's in the middle between the
/// lines, the filament's as the mean over most of a bead and the median over neighbouring lines, so
/// that neither a break nor a shadow in one line sets it. Where light makes the plate the brighter
/// one, the same holds with the sign turned round; between, where both look alike (filament stands
/// out by less than twice the plate's grain), nothing is measured. Reads 200 places a line, evenly
/// from rail to rail.
/// @param contrast  filament higher than plate.
/// @param line_pattern    REQUIRES an empty problem and at least 2 rungs.
[[nodiscard]] BeadWidths MeasureBeadWidths(const GrayImage& contrast,
                                           const LinePattern& line_pattern);

}  // namespace trammel::vision

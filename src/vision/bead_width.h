// How wide printed lines are, all along.
#pragma once

#include <vector>

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::vision {

/// One place on a line.
struct BeadReading {
  double x_px = 0;
  double centre_px = 0;  ///< y of the bead's middle (of its track where it is broken)
  double width_px = 0;   ///< about 0 where the filament broke; may fall below 0 by noise
  double sigma_px = 0;   ///< 1 sigma; 0 where nothing can be measured
  bool seen = true;      ///< false beyond the photo's border
};

struct BeadWidths {
  std::vector<std::vector<BeadReading>> lines;  ///< per rung, per place along the line
  double blur_px = 0;  ///< sigma of the bead edges' blur, from their steepest slope
};

struct BeadWidthOptions {
  std::size_t places = 200;     ///< per line, evenly from rail to rail, [10, 2000]
  double least_contrast = 2.0;  ///< filament above plate, over the plate's own grain in one cell;
                                ///< below it nothing is measured (glare), (0, 100]
};

/// Integrates, across each line, the brightness above the plate's over that of the filament above
/// the plate's. A blurred edge does not change such an integral, and the texture of a plate adds to
/// it as noise without bias. Both levels are found locally: the plate's in the middle between the
/// lines, the filament's on the lines' middle, as a median over neighbouring lines, so that neither
/// a break nor a shadow in one line sets it. Where light makes the plate the brighter one, the same
/// holds with the sign turned round; between, where both look alike, nothing is measured.
/// @param contrast  filament higher than plate.
/// @param line_pattern    REQUIRES an empty problem and at least 2 rungs.
[[nodiscard]] BeadWidths MeasureBeadWidths(const GrayImage& contrast,
                                           const LinePattern& line_pattern,
                                           const BeadWidthOptions& options = {});

}  // namespace trammel::vision

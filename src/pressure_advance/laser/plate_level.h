// The plate's level along a sweep: what single frames show, held against their neighbours.
#pragma once

#include <cstddef>
#include <vector>

#include "pressure_advance/laser/bead_band.h"

namespace trammel::pressure_advance {

/// The plate in one sweep: level(frame) + slope · (row - pivot).
struct Plate {
  double slope = 0;
  double pivot = 0;
  std::vector<double> level;
  std::vector<double> sigma;  ///< of the level; 0: this frame does not show it
  std::vector<double> sides;  ///< what the level errs by, from the plate on the bead's two sides
                              ///< against each other; NaN: this frame shows one of them at most

  [[nodiscard]] double at(std::size_t frame, double row) const {
    return level[frame] + slope * (row - pivot);
  }
};

/// Draws the levels towards their trend as far as their scatter about it is noise: what the rows'
/// sigmas foretell, or what the bead's two sides differ by where that is more, as glints and a
/// texture as wide as the plate shown beside the bead make it.
/// @param row_correlation  variance of a sum over rows / sum of the rows' stated variances.
void ShrinkToTrend(double row_correlation, Plate& plate);

/// Replaces levels that a swell holds up: where the bead reaches nearly to the picture's ends, the
/// rows beside its band are bead, too. Frames with a swell, or far above the sweep's straight line,
/// are held against the trend of the others; beyond noise and a sixth of the bead's height they
/// take that.
/// @param peak_px  the bead's height in the typical frame.
/// @returns per frame: the level was replaced.
[[nodiscard]] std::vector<bool> BridgeSwells(const BeadBand& band, double peak_px, Plate& plate);

}  // namespace trammel::pressure_advance

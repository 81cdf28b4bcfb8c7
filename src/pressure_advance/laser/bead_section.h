// One frame's heights across the bead.
#pragma once

#include <cstddef>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/laser/plate_reference.h"

namespace trammel::pressure_advance {

/// The rows of the bead's band in one frame, unseen ones bridged. Places are rows from the band's
/// centre; of a row that a range cuts a part counts.
struct BeadSection {
  std::vector<double> height;    ///< px above the plate
  std::vector<double> variance;  ///< px², of each row by itself
  double first_row = 0;          ///< where the first row's middle lies
  Interval band;
  int longest_bridge = 0;  ///< rows

  /// Share of row i within the range, 0 … 1.
  [[nodiscard]] double Share(std::size_t i, const Interval& range) const;

  /// Sum of the heights within the range, px · rows.
  [[nodiscard]] double Sum(const Interval& range) const;

  /// Mean of row i and those next to it within the band.
  [[nodiscard]] double Smooth(std::size_t i) const;
};

/// Cuts the band out of a frame. Rows without laser (a flank in shadow) are bridged in a straight
/// line between the nearest rows that have one; beyond the band that is the plate.
[[nodiscard]] BeadSection CutSection(const PlateHeights& plate, std::size_t frame);

}  // namespace trammel::pressure_advance

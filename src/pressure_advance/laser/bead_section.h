// One frame's heights across the bead.
#pragma once

#include <cstddef>
#include <vector>

#include "pressure_advance/laser/plate_reference.h"

namespace trammel::pressure_advance {

/// Rows from one place to another, counted from the band's centre; parts of rows count as parts.
struct RowRange {
  double lo = 0;
  double hi = 0;
};

/// The rows of the bead's band in one frame, unseen ones bridged.
struct BeadSection {
  std::vector<double> height;    ///< px above the plate
  std::vector<double> variance;  ///< px², of each row by itself
  double first_row = 0;          ///< where the first row's middle lies, from the band's centre
  RowRange band;
  int longest_bridge = 0;  ///< rows

  /// Share of row i within the range, 0 … 1.
  [[nodiscard]] double Share(std::size_t i, const RowRange& range) const;

  /// Sum of the heights within the range, px · rows.
  [[nodiscard]] double Sum(const RowRange& range) const;

  /// Mean of row i and those next to it within the band.
  [[nodiscard]] double Smooth(std::size_t i) const;
};

/// Cuts the band out of a frame. Rows without laser (a flank in shadow) are bridged in a straight
/// line between the nearest rows that have one; beyond the band that is the plate.
[[nodiscard]] BeadSection CutSection(const PlateHeights& plate, std::size_t frame);

}  // namespace trammel::pressure_advance

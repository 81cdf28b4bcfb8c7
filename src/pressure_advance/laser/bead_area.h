// Measures the bead's cross-section above the plate, and its extent.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/laser/plate.h"

namespace trammel::pressure_advance {

/// Rows of the bead's band in one frame, with unseen rows interpolated. Positions are rows from the
/// band's centre; a row cut by a range counts in part.
struct BeadSection {
  std::vector<double> height;    ///< px above the plate
  std::vector<double> variance;  ///< px², of each row by itself
  double first_row = 0;          ///< centre of the first row
  Interval band;
  int longest_bridge = 0;  ///< rows

  /// Returns the share of row i within the range, 0 … 1.
  [[nodiscard]] double Share(std::size_t i, const Interval& range) const;

  /// Returns the sum of the heights within the range, px · rows.
  [[nodiscard]] double Sum(const Interval& range) const;

  /// Returns the mean of row i and its neighbours within the band.
  [[nodiscard]] double Smooth(std::size_t i) const;
};

/// Extracts the band of a frame. Rows without laser (a flank in shadow) are linearly interpolated
/// between the nearest rows with laser; beyond the band the plate counts as neighbour.
[[nodiscard]] BeadSection CutSection(const PlateHeights& plate, std::size_t frame);

/// Finds the rows of each frame that a bead of its size covers.
///
/// The band is as wide as the sweep's widest beads. Beside most beads it contains plate, whose
/// texture adds noise to the area, and which shines where light scattered in the bead emerges. Each
/// flank's position is a straight line over the area, fitted to the sweep's own beads (least median
/// of squares). A bead is summed up to a margin beyond it. The range is extended for a bead that
/// rises further outside.
/// @param sections  of a sweep's frames, whatever their band.
/// @param tells  per frame: true if its flanks enter the fit and its band may be narrowed.
/// @param noise_px  1 sigma of one row's height.
/// @returns per frame the rows within its band; the whole band if too few frames (12) qualify
///     for the fit.
[[nodiscard]] std::vector<Interval> FindReach(std::span<const BeadSection> sections,
                                              const std::vector<bool>& tells, double noise_px);

}  // namespace trammel::pressure_advance

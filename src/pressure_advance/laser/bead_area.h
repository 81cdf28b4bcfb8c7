// Measures the section of the bead above the plate, and how far it reaches.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/laser/plate.h"

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

/// The rows of each frame that a bead of its size covers.
///
/// The band is as wide as the sweep's widest beads; beside most beads it holds plate, whose texture
/// is noise in the area and which shines where light that spreads in the bead comes out again. Each
/// flank's place is a straight line over the area, learnt of the sweep's own beads (least median of
/// squares), and a bead is summed up to a margin beyond it. A bead that stands up further by itself
/// is followed.
/// @param sections  of a sweep's frames, whatever their band.
/// @param tells  per frame: whether its flanks may be learnt of and its band may be narrowed.
/// @param noise_px  1 sigma of one row's height.
/// @returns per frame the rows within its band; the whole band where frames that tell are too few
///     (12) to learn of.
[[nodiscard]] std::vector<Interval> FindReach(std::span<const BeadSection> sections,
                                              const std::vector<bool>& tells, double noise_px);

}  // namespace trammel::pressure_advance

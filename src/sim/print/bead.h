// From the filament laid along a stroke to the shape of its bead.
#pragma once

#include <span>

#include "base/random.h"

namespace trammel::sim {

struct BeadShape {
  double width_mm = 0;   ///< at the plate
  double height_mm = 0;  ///< of the top above the plate
};

struct BeadOptions {
  double nozzle_diameter_mm = 0.4;
  double smear_mm = 0.3;
  double break_area_mm2 = 0.012;
};

/// The area of a stadium: a rectangle with half-round sides. REQUIRES width >= height >= 0.
[[nodiscard]] double StadiumArea(double width_mm, double height_mm);

/// The cross-section that an area takes under a nozzle gap_mm above the plate. Between a round
/// thread and a full bead it is a stadium as high as the gap; with less material it stays round and
/// sinks; with more than a full bead (FullArea) it squeezes out and rises beside the nozzle, at
/// most to twice the gap. Continuous and rising in area. REQUIRES area >= 0, gap > 0.
[[nodiscard]] BeadShape ShapeOf(double area_mm2, double gap_mm, const BeadOptions& options);

/// The area of a bead 1.25 nozzle diameters wide: what lies under the nozzle and no more.
[[nodiscard]] double FullArea(double gap_mm, const BeadOptions& options);

/// Levels the area along the path with a triangular footprint of full width at half maximum
/// smear_mm; reflects at the ends, so that the volume stays. Here and below a node stands for one
/// spacing of length, the first and the last for half of one.
void Smear(std::span<double> area_mm2, double spacing_mm, double smear_mm);

/// Spreads what exceeds a full bead along the path, the more the more there is: molten material
/// squeezed out beside the nozzle goes round, about as far along the path as across it. Keeps the
/// volume. REQUIRES one full area per node.
void SpreadSurplus(std::span<double> area_mm2, std::span<const double> full_mm2, double spacing_mm);

/// Parts the bead where its area lies below break_area_mm2 (but above 0): the material there
/// gathers in droplets of 1.5 times that area, at least 0.15 mm long, about 0.8 mm apart, or joins
/// the bead next to it. Keeps the volume.
void BreakUp(std::span<double> area_mm2, double spacing_mm, double break_area_mm2, Random& random);

}  // namespace trammel::sim

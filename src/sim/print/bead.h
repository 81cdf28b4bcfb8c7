// From the filament laid along a stroke to the shape of its bead.
#pragma once

#include <span>

#include "base/random.h"
#include "sim/print/bed.h"

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

/// Multiplies areas by 1 + noise: standard deviation sigma, correlation falling as
/// exp(-distance / length).
void AddFlowNoise(std::span<double> area_mm2, double spacing_mm, double sigma, double length_mm,
                  Random& random);

/// Adds bumps of 0.02 … 0.10 mm^3, about 0.6 mm long, at random places.
void AddBlobs(std::span<double> area_mm2, double spacing_mm, double blobs_per_m, Random& random);

/// Takes the material away over 0.3 … 1.2 mm at random places.
void CutGaps(std::span<double> area_mm2, double spacing_mm, double gaps_per_m, Random& random);

/// A thin thread, 0.06 … 0.1 mm thick and 1 … 4 mm long, that wanders off from a point.
[[nodiscard]] Strand DrawString(double x_mm, double y_mm, double spacing_mm, Random& random);

/// How many of something that happens at a rate fall on a length (Poisson).
[[nodiscard]] int DrawCount(double per_m, double length_mm, Random& random);

}  // namespace trammel::sim

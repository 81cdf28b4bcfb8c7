// Shape of a bead, from the filament laid along a stroke.
#pragma once

#include <span>

#include "base/random.h"
#include "sim/print/bed.h"

namespace trammel::sim {

struct BeadShape {
  double width_mm = 0;   ///< at the plate
  double height_mm = 0;  ///< top above the plate
};

struct BeadOptions {
  double nozzle_diameter_mm = 0.4;
  double smear_mm = 0.3;
  double break_area_mm2 = 0.012;
  double most_rise = 1;  ///< of the top above the nozzle, in gaps; less where later passes level it
};

/// Returns the area of a stadium: a rectangle with half-round sides. REQUIRES width >= height >= 0.
[[nodiscard]] double StadiumArea(double width_mm, double height_mm);

/// Returns the cross-section of an area under a nozzle gap_mm above the plate. Between a round
/// thread and a full bead it is a stadium as high as the gap. Less material remains round and
/// sinks; more than a full bead (FullArea) squeezes out and rises beside the nozzle, at most by
/// most_rise gaps. Continuous and rising in area. REQUIRES area >= 0, gap > 0.
[[nodiscard]] BeadShape ShapeOf(double area_mm2, double gap_mm, const BeadOptions& options);

/// Returns the area of a bead 1.25 nozzle diameters wide: the material that just fits under the
/// nozzle.
[[nodiscard]] double FullArea(double gap_mm, const BeadOptions& options);

/// Smooths the area along the path with a triangular footprint of full width at half maximum
/// smear_mm; reflects at the ends, so that the volume is conserved. Here and below a node
/// represents one spacing of length, the first and the last half of one.
void Smear(std::span<double> area_mm2, double spacing_mm, double smear_mm);

/// Spreads the surplus over a full bead along the path, over a distance that grows with it: molten
/// material squeezed out beside the nozzle becomes round, about as long as wide. Conserves the
/// volume. REQUIRES one full area per node.
void SpreadSurplus(std::span<double> area_mm2, std::span<const double> full_mm2, double spacing_mm);

/// Breaks the bead where its area is below break_area_mm2 (but above 0): the material there forms
/// droplets of 1.5 times that area, at least 0.15 mm long, about 0.8 mm apart, or joins the bead
/// next to it. Conserves the volume.
void BreakUp(std::span<double> area_mm2, double spacing_mm, double break_area_mm2, Random& random);

/// Multiplies areas by 1 + noise: standard deviation sigma, correlation falling as
/// exp(-distance / length).
void AddFlowNoise(std::span<double> area_mm2, double spacing_mm, double sigma, double length_mm,
                  Random& random);

/// Adds bumps of 0.02 … 0.10 mm^3, about 0.6 mm long, at random places.
void AddBlobs(std::span<double> area_mm2, double spacing_mm, double blobs_per_m, Random& random);

/// Removes the material over 0.3 … 1.2 mm at random positions.
void CutGaps(std::span<double> area_mm2, double spacing_mm, double gaps_per_m, Random& random);

/// Draws a thin thread, 0.06 … 0.1 mm thick and 1 … 4 mm long, that wanders off from a point.
[[nodiscard]] Strand DrawString(double x_mm, double y_mm, double spacing_mm, Random& random);

/// Draws the number of events on a length, at a given rate (Poisson).
[[nodiscard]] int DrawCount(double per_m, double length_mm, Random& random);

}  // namespace trammel::sim

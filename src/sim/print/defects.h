// What goes wrong along a line beside pressure: flow noise, blobs, gaps and strings.
#pragma once

#include <span>

#include "base/random.h"
#include "sim/print/bed.h"

namespace trammel::sim {

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

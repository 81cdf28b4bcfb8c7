// Heights over the plate: the laser line less the line it would be without a bead.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/laser/bead_band.h"
#include "pressure_advance/laser/height_map.h"

namespace trammel::pressure_advance {

/// What a sweep's laser lines say once the plate is known.
struct PlateHeights {
  HeightMap heights;  ///< relative to the plate, rising surface positive
  BeadBand band;
  std::vector<double> plate_sigma_px;  ///< per frame: 1 sigma of the plate's level at the bead
  std::vector<bool> cut_off;  ///< per frame: the bead reaches out of the picture, or as near to its
                              ///< ends as leaves no plate
  double row_correlation = 1;  ///< variance of a sum over rows / sum of variances, on the plate
  double noise_px = 0;         ///< typical 1 sigma of one row
  double bead_px = 0;          ///< height of the bead, mean over the sweep, at its centre
  std::string fault;           ///< why there is no bead in here; the rest is then unfinished
};

/// Finds plate and bead in a sweep's laser lines.
///
/// The plate's slope is common to the sweep; its level is fitted per frame from the rows beside the
/// bead and drawn towards its own trend as far as its scatter is no more than noise. Sigmas are
/// scaled to the scatter seen on the plate.
/// @param lines  height_px is the line's column times the sign that makes rising surfaces positive.
[[nodiscard]] PlateHeights FindPlate(const HeightMap& lines);

}  // namespace trammel::pressure_advance

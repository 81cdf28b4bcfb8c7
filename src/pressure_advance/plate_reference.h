// Heights over the plate: the laser line less the line it would be without a bead.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "pressure_advance/height_map.h"

namespace trammel::pressure_advance {

/// The rows of one frame that the bead may cover: centre ± half_width.
struct BeadBand {
  double first_centre = 0;  ///< bead's centre row in the first frame
  double drift = 0;         ///< rows per frame (a sweep not quite along the line)
  double half_width = 0;    ///< rows, > 0

  [[nodiscard]] double centre(std::size_t frame) const {
    return first_centre + drift * static_cast<double>(frame);
  }
};

/// What a sweep's laser lines say once the plate is known.
struct PlateHeights {
  HeightMap heights;  ///< relative to the plate, rising surface positive
  BeadBand band;
  std::vector<double> plate_sigma_px;  ///< per frame: 1 sigma of the plate's level at the bead
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

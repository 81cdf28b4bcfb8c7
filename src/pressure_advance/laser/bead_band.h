// Which rows of a sweep's frames the bead covers.
#pragma once

#include <cstddef>
#include <vector>

#include "pressure_advance/laser/height_map.h"

namespace trammel::pressure_advance {

/// The rows of one frame that the bead may cover: centre ± half().
struct BeadBand {
  double first_centre = 0;    ///< bead's centre row in the first frame
  double drift = 0;           ///< rows per frame (a sweep not quite along the line)
  double half_width = 0;      ///< rows, > 0
  std::vector<double> swell;  ///< per frame: rows by which a swell reaches beyond half_width to
                              ///< either side; empty: none does

  [[nodiscard]] double centre(std::size_t frame) const {
    return first_centre + drift * static_cast<double>(frame);
  }
  [[nodiscard]] double half(std::size_t frame) const {
    return half_width + (swell.empty() ? 0 : swell[frame]);
  }
};

/// Whether a row lies clear of the bead.
[[nodiscard]] bool OnPlate(const BeadBand& band, std::size_t frame, std::size_t row);

/// The median over the frames of each row's height above the plate.
struct TypicalFrame {
  std::vector<double> height;  ///< px; 0 in rows seldom seen
  std::vector<bool> seen;
};

struct FoundBand {
  BeadBand band;
  double peak_px = 0;  ///< the bead's height in the typical frame; 0: no bead
};

/// The highest place of the typical frame and what stands up around it.
[[nodiscard]] FoundBand FindBand(const TypicalFrame& typical);

/// How the bead's centre wanders over the rows, from frames with a clear bead.
/// @param heights  above the plate.
void FollowBead(const HeightMap& heights, double peak_px, BeadBand& band);

/// Widens the band to what nearly all of the sweep's beads cover: outwards from the centre as long
/// as one frame in twenty, averaged with its neighbours, clearly stands above the plate. A quarter
/// of the rows stays with the plate.
/// @param noise_px  1 sigma of one row's height.
void WidenBand(const HeightMap& heights, double noise_px, double peak_px, BeadBand& band);

/// Widens the band in single frames as far as a swell stands above the plate beyond it, averaged
/// with the frames next to it.
/// @param noise_px  1 sigma of one row's height.
/// @returns per frame: the bead still stands above the plate at an end of the picture.
[[nodiscard]] std::vector<bool> FollowSwells(const HeightMap& heights, double noise_px,
                                             double peak_px, BeadBand& band);

}  // namespace trammel::pressure_advance

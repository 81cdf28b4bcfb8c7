// Estimates the plate and the bead's band from a sweep's laser lines.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace trammel::pressure_advance {

/// Heights over one printed line: one column of the map per frame, one row per image row.
/// Shape (frames, rows), frame-major: index = frame * rows + row.
struct HeightMap {
  std::size_t frames = 0;
  std::size_t rows = 0;
  std::vector<float> height_px;  ///< shift of the laser line in the direction of height
  std::vector<float>
      sigma_px;  ///< 1 sigma; 0 where the row has no laser line (height_px is then 0)
  std::vector<double> position_mm;  ///< of the laser at each frame, from the printed start; empty
                                    ///< where the recording does not say

  [[nodiscard]] std::size_t index(std::size_t frame, std::size_t row) const {
    return frame * rows + row;
  }
};

/// Further data of the laser reader about a recording, beside the line profiles.
struct LaserScanView {
  std::vector<HeightMap> heights;        ///< per line, by the response eye, relative to the plate
  std::vector<HeightMap> paper_heights;  ///< per line, by the paper's method
};

/// Rows of one frame that the bead may cover: centre ± half().
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

/// True if a row is clear of the bead.
[[nodiscard]] bool OnPlate(const BeadBand& band, std::size_t frame, std::size_t row);

/// Median over the frames of each row's height above the plate.
struct TypicalFrame {
  std::vector<double> height;  ///< px; 0 in rows seldom seen
  std::vector<bool> seen;
};

struct FoundBand {
  BeadBand band;
  double peak_px = 0;  ///< the bead's height in the typical frame; 0: no bead
};

/// Finds the highest point of the typical frame and the raised rows around it.
[[nodiscard]] FoundBand FindBand(const TypicalFrame& typical);

/// Follows the bead's centre over the rows, in frames with a clear bead.
/// @param heights  above the plate.
void FollowBead(const HeightMap& heights, double peak_px, BeadBand& band);

/// Widens the band to the rows that nearly all of the sweep's beads cover: outwards from the centre
/// as long as one frame in twenty, averaged with its neighbours, is clearly above the plate. A
/// quarter of the rows is reserved for the plate.
/// @param noise_px  1 sigma of one row's height.
void WidenBand(const HeightMap& heights, double noise_px, double peak_px, BeadBand& band);

/// Widens the band in single frames as far as a swell beyond it is above the plate, averaged with
/// the neighbouring frames.
/// @param noise_px  1 sigma of one row's height.
/// @returns per frame: true if the bead is above the plate even at an end of the picture.
[[nodiscard]] std::vector<bool> FollowSwells(const HeightMap& heights, double noise_px,
                                             double peak_px, BeadBand& band);

/// Plate in one sweep: level(frame) + slope · (row - pivot).
struct Plate {
  double slope = 0;
  double pivot = 0;
  std::vector<double> level;
  std::vector<double> sigma;  ///< sigma of the level; 0: not seen in this frame
  std::vector<double> sides;  ///< what the level errs by, from the plate on the bead's two sides
                              ///< against each other; NaN: this frame shows one of them at most

  [[nodiscard]] double at(std::size_t frame, double row) const {
    return level[frame] + slope * (row - pivot);
  }
};

/// Shrinks the levels towards their trend by the share of noise in their scatter. The noise is that
/// predicted by the rows' sigmas, or the difference between the bead's two sides if larger. Glints
/// cause such differences, and so does a texture as wide as the visible plate.
/// @param row_correlation  variance of a sum over rows / sum of the rows' stated variances.
void ShrinkToTrend(double row_correlation, Plate& plate);

/// Replaces levels raised by a swell: if the bead reaches nearly to the picture's ends, the rows
/// beside its band are bead, too. Frames with a swell, or far above the sweep's straight line, are
/// compared with the trend of the others. Where they exceed noise and a sixth of the bead's height,
/// the trend replaces them.
/// @param peak_px  the bead's height in the typical frame.
/// @returns per frame: true if the level was replaced.
[[nodiscard]] std::vector<bool> BridgeSwells(const BeadBand& band, double peak_px, Plate& plate);

/// Heights from a sweep's laser lines, for a known plate.
struct PlateHeights {
  HeightMap heights;  ///< relative to the plate, rising surface positive
  BeadBand band;
  std::vector<double> plate_sigma_px;  ///< per frame: 1 sigma of the plate's level at the bead
  std::vector<bool> cut_off;  ///< per frame: the bead reaches out of the picture, or as near to its
                              ///< ends as leaves no plate
  double row_correlation = 1;  ///< variance of a sum over rows / sum of variances, on the plate
  double noise_px = 0;         ///< typical 1 sigma of one row
  double bead_px = 0;          ///< height of the bead, mean over the sweep, at its centre
  std::string fault;           ///< why there is no bead; other fields are then incomplete
};

/// Finds plate and bead in a sweep's laser lines.
///
/// The plate's slope is common to the sweep. Its level is fitted per frame from the rows beside the
/// bead and shrunk towards its own trend as far as its scatter is only noise. Sigmas are scaled to
/// the scatter seen on the plate.
/// @param lines  height_px is the line's column times the sign that makes rising surfaces positive.
[[nodiscard]] PlateHeights FindPlate(const HeightMap& lines);

}  // namespace trammel::pressure_advance

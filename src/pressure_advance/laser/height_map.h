// What the laser eye reads from one sweep, before it becomes a line profile.
#pragma once

#include <cstddef>
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

/// Everything the laser eye keeps of a recording beside the line profiles.
struct LaserScanView {
  std::vector<HeightMap> heights;        ///< per line, by the response eye, relative to the plate
  std::vector<HeightMap> paper_heights;  ///< per line, by the paper's method
};

}  // namespace trammel::pressure_advance

// A recording of lag_line's printed lines in laser_world's light, as a folder on disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/frame.h"
#include "base/random.h"
#include "support/lag_line.h"
#include "support/sweep_world.h"

namespace trammel::test {

/// The pattern and the sweep are the paper's; the pictures are small.
struct LagRecording {
  std::vector<double> pressure_advance_s = {0,
                                            0.06 / 9,
                                            0.06 / 9 * 2,
                                            0.06 / 9 * 3,
                                            0.06 / 9 * 4,
                                            0.06 / 9 * 5,
                                            0.06 / 9 * 6,
                                            0.06 / 9 * 7,
                                            0.06 / 9 * 8,
                                            0.06};
  testing::LagModelTruth law{.linear_s = 0.03};  ///< linear_s is then the right pressure advance
  testing::LagLine line{.step_mm = 1.0 / 4.5};  ///< step_mm is also the sweep's: 6.667 mm/s, 30 / s
  LaserWorld world;
  double area_mm2 = 0.11;      ///< bead area at steady flow
  double line_start_mm = 4;    ///< also left out at the line's end
  double flow_scatter = 0.01;  ///< 1 sigma from line to line, relative
  std::uint64_t seed = 1;
};

/// The frames of one sweep, in print direction.
[[nodiscard]] std::vector<Frame> RecordSweep(const LagRecording& recording,
                                             double pressure_advance_s, Random& random);

/// Writes scan.json and line0.avi, line1.avi, … into an existing folder.
void WriteRecording(const LagRecording& recording, const std::filesystem::path& folder);

}  // namespace trammel::test

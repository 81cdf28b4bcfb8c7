// Error of the frames' positions in a recording against their true ones.
#pragma once

#include <filesystem>
#include <vector>

#include "sim/camera/camera_server.h"

namespace trammel::test {

struct PlacedFrames {
  std::vector<double> error_mm;  ///< per frame with a place in scan.json, signed
  int unplaced = 0;              ///< frames without one
  int unmatched = 0;             ///< frames whose truth could not be told; must be 0
};

/// Returns the median magnitude (mm) of the placed frames' errors: a busy computer may send up to
/// half of the pictures late. REQUIRES a placed frame.
[[nodiscard]] double MedianPlaceError_mm(const PlacedFrames& placed);

/// Compares a recorded scan (scan.json, the .times of its videos, pattern.plan.json) with the
/// camera's own log. Frames with a capture time are found by it, others by their order.
/// REQUIRES a camera that lost no frame on its way where it names no capture times, and lines in x.
[[nodiscard]] PlacedFrames CompareWithTruth(const std::filesystem::path& recording,
                                            const std::vector<sim::CameraTruth>& truth,
                                            double camera_offset_x_mm = 28);

}  // namespace trammel::test

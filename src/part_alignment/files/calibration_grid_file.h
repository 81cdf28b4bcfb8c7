// What a camera's calibration out of the machine reads, and the camera file it leaves.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "part_alignment/camera/calibrate.h"

namespace trammel::files {

struct CalibrationGridFile {
  part_alignment::GridMeasurement grid;
  std::string date;  ///< YYYY-MM-DD
};

/// GRID.json (docs/formats.md). Errors (kInput) name file and place: not JSON, a key that is
/// missing, unknown or out of its range.
[[nodiscard]] Result<CalibrationGridFile> ReadCalibrationGrid(const std::filesystem::path& path);

/// The camera file of a good calibration: readable as any other, with the covariance beside.
[[nodiscard]] std::string CalibratedCameraText(const part_alignment::CameraCalibration& calibration,
                                               const std::string& date);

}  // namespace trammel::files

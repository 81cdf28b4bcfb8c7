// Data for scoring and the report, from a recorded laser scan on disk.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/laser/deviation.h"
#include "pressure_advance/laser/plate.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::app {

/// Measurements of one recording, in the order of scan.lines.
struct LaserMeasurement {
  pressure_advance::Scan scan;  ///< as recorded; `crop` filled in if it was detected
  std::vector<pressure_advance::LineProfile> profiles;  ///< area in mm^2, or px^2 without a scale
  pressure_advance::LaserScanView view;
  pressure_advance::DeviationResult deviation;
  std::vector<std::string> notices;  ///< for the user: detected crop, frames left out …
};

/// Reads `folder`/scan.json and every video that it names, as many at a time as there are
/// processors; the result does not depend on their number.
/// @returns kInput where scan.json is missing or wrong, kMeasurement where a video is missing,
///          empty or broken or its frames change size. A line whose frames hold no laser or no bead
///          is not an error: its profile says why it is unusable.
/// Memory: the cropped frames of as many lines as are read at a time, fewer where crop_px is large.
[[nodiscard]] Result<LaserMeasurement> MeasureRecording(const std::filesystem::path& folder);

}  // namespace trammel::app

// From a path on the command line to a finished analysis: a recording's folder or a photo.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/analysis.h"
#include "pressure_advance/height_map.h"
#include "pressure_advance/line_motion.h"

namespace trammel::app {

/// An analysis with what its eye keeps for the report.
struct AnalysisRun {
  pressure_advance::Analysis analysis;
  std::optional<pressure_advance::LaserScanView> scan;
};

/// Reads `FRACTION:SPEED,FRACTION:SPEED,…`, for example 0.1:10,0.6:100,0.3:10.
/// @returns segments whose fractions sum to 1 (to 1e-3) and whose speeds lie within 0.1 … 2000
/// mm/s, or an
///   error that names the part and the bound.
[[nodiscard]] Result<std::vector<pressure_advance::Segment>> ParseSegments(const std::string& text);

/// Analyses a recorded laser scan. A recording that does not hold what its scan.json promises (a
/// missing, empty or broken video) gives a refused analysis; a scan.json that cannot be used gives
/// an error.
[[nodiscard]] Result<AnalysisRun> AnalyseRecording(const std::filesystem::path& folder,
                                                   pressure_advance::Method method);

}  // namespace trammel::app

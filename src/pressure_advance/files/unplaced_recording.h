// A scan's folder without a scan.json: what is there, and what is missing to analyse it.
#pragma once

#include <filesystem>
#include <optional>

#include "base/result.h"

namespace trammel::files {

/// Says of a folder with sweeps.json, which a scan writes before its first frame, why it cannot be
/// analysed: the scan ended in its first sweep, or no frame could be tied to the motion. Absent
/// where there is no sweeps.json. Kind: kMeasurement, or kInput where sweeps.json cannot be read.
[[nodiscard]] std::optional<Error> UnplacedRecording(const std::filesystem::path& folder);

}  // namespace trammel::files

// What an alignment's stated uncertainty does not hold, and no residual shows.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "part_alignment/camera/calibration_record.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

/// A sentence for each: a camera used outside the distances it was calibrated at, or calibrated
/// long ago; inputs that leave the part's place less certain than any view should. None unless the
/// verdict is good.
/// @param calibration  absent: nothing is known of it, and nothing said
/// @param today        YYYY-MM-DD
[[nodiscard]] std::vector<std::string> Caveats(const Measurement& measurement,
                                               const SolveOptions& options,
                                               const Alignment& alignment,
                                               const std::optional<CalibrationRecord>& calibration,
                                               std::string_view today);

}  // namespace trammel::part_alignment

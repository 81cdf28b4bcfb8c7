// Why a table of places and its pictures do not fit: signs, units, order, each tried out.
#pragma once

#include <optional>
#include <string>

#include "part_alignment/board/board_calibration.h"

namespace trammel::part_alignment {

/// Pictures that are the mirror image of their places: which axes' signs, or which exchange, would
/// put it right, and how the camera would then sit; empty where none would. REQUIRES Validate.
[[nodiscard]] std::string WordsForMirrored(const BoardMeasurement& measurement);

/// The fault of the table that explains residuals of `root` sigmas; absent where none does.
/// REQUIRES Validate.
[[nodiscard]] std::optional<std::string> FindTableFault(const BoardMeasurement& measurement,
                                                        double root);

/// Residuals of an adjustment from nothing, in their sigmas (root mean square); infinite where
/// there is none.
[[nodiscard]] double RootOf(const BoardMeasurement& measurement);

/// Where the picture's columns run in the machine at the first angle, in words.
[[nodiscard]] std::string ColumnsInWords(const Camera& camera,
                                         const Eigen::Matrix3d& machine_from_taper);

}  // namespace trammel::part_alignment

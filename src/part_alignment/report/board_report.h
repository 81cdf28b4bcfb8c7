// A calibration by a board as text, JSON and a page.
#pragma once

#include <string>

#include "part_alignment/board/board_calibration.h"

namespace trammel::report {

/// One object (docs/formats.md), ended by a newline. What is meant only with verdict good is null
/// otherwise.
[[nodiscard]] std::string ToJson(const part_alignment::BoardCalibration& calibration);

/// Several lines.
[[nodiscard]] std::string BoardCalibrationText(const part_alignment::BoardCalibration& calibration);

/// HTML that stands alone. @param date  of the calibration, as its file says it.
[[nodiscard]] std::string BoardCalibrationPage(const std::string& date,
                                               const part_alignment::BoardCalibration& calibration);

}  // namespace trammel::report

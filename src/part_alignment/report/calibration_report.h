// Writes a camera's calibration, by a measuring machine's grid or by a board on the machine's own
// table, as JSON, text, figures and page.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "document/figure.h"
#include "part_alignment/board/board_calibration.h"
#include "part_alignment/camera/calibrate.h"

namespace trammel::report {

/// Returns one object (docs/reference/formats.md), ended by a newline. Values that need verdict
/// good are null otherwise.
[[nodiscard]] std::string ToJson(const part_alignment::CameraCalibration& calibration);
[[nodiscard]] std::string ToJson(const part_alignment::BoardCalibration& calibration);

/// Several lines.
[[nodiscard]] std::string CalibrationText(const part_alignment::CameraCalibration& calibration);
[[nodiscard]] std::string CalibrationText(const part_alignment::BoardCalibration& calibration);

/// "projection-uncertainty": a map over the sensor at the grid's middle distance; "residuals":
/// arrows, enlarged as its key says. REQUIRES a calibration with verdict good of this grid.
[[nodiscard]] std::vector<Figure> CalibrationFigures(
    const part_alignment::GridMeasurement& grid,
    const part_alignment::CameraCalibration& calibration);

/// Returns self-contained HTML. @param date  of the calibration, as in its file.
[[nodiscard]] std::string CalibrationPage(const std::string& date,
                                          const part_alignment::CameraCalibration& calibration,
                                          std::span<const Figure> figures);
[[nodiscard]] std::string CalibrationPage(const std::string& date,
                                          const part_alignment::BoardCalibration& calibration);

}  // namespace trammel::report

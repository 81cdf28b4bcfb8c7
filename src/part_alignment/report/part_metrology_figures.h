// The figures of a camera's calibration and of a part fit.
#pragma once

#include <vector>

#include "document/figure.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/part_fit/part_fit.h"

namespace trammel::report {

/// "projection-uncertainty": a map over the sensor at the grid's middle distance; "residuals":
/// arrows, enlarged as its key says. REQUIRES a calibration with verdict good of this grid.
[[nodiscard]] std::vector<Figure> CalibrationFigures(
    const part_alignment::GridMeasurement& grid,
    const part_alignment::CameraCalibration& calibration);

/// "stock-allowance": every point with its surplus over what is wanted, on the side of the part
/// that its surface faces there; sides without points are left out. What the placement rests on is
/// named. REQUIRES stock allowances of this input.
[[nodiscard]] Figure StockAllowanceFigure(const part_alignment::PartFitInput& input,
                                          const part_alignment::PartFit& fit);

}  // namespace trammel::report

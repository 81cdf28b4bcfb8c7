// The pages of a camera's calibration and of a part fit.
#pragma once

#include <span>
#include <string>

#include "document/figure.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/part_fit/part_fit.h"

namespace trammel::report {

// HTML that stands alone: the answer with its 95 % interval or the reason why there is none, what
// to do next, the figures.

/// @param date  of the grid, as its file says it.
[[nodiscard]] std::string CalibrationPage(const std::string& date,
                                          const part_alignment::CameraCalibration& calibration,
                                          std::span<const Figure> figures);
[[nodiscard]] std::string PartFitPage(const part_alignment::PartFitInput& input,
                                      const part_alignment::PartFit& fit,
                                      std::span<const Figure> figures);

}  // namespace trammel::report

// The pages of a camera's calibration and of a part fit.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "document/figure.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/part_fit/part_fit.h"

namespace trammel::report {

// Pages of AnswerPageHtml.

/// What to do next with a calibrated camera, or without one.
/// @param again  what to do where it is not good, as an order: "measure another grid"
[[nodiscard]] std::string CameraWords(bool good, double nearest_mm, double farthest_mm,
                                      std::string_view again);

/// @param date  of the grid, as its file says it.
[[nodiscard]] std::string CalibrationPage(const std::string& date,
                                          const part_alignment::CameraCalibration& calibration,
                                          std::span<const Figure> figures);
[[nodiscard]] std::string PartFitPage(const part_alignment::PartFitInput& input,
                                      const part_alignment::PartFit& fit,
                                      std::span<const Figure> figures);

}  // namespace trammel::report

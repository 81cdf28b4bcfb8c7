// A camera's calibration, a part fit and a budget: as JSON, and as text for people.
#pragma once

#include <string>
#include <vector>

#include "part_alignment/budget/budget.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/part_fit/part_fit.h"

namespace trammel::report {

// One object each (docs/formats.md), ended by a newline. What is meant only with verdict good is
// null otherwise.

[[nodiscard]] std::string ToJson(const part_alignment::CameraCalibration& calibration);
[[nodiscard]] std::string ToJson(const part_alignment::PartFitInput& input,
                                 const part_alignment::PartFit& fit);
[[nodiscard]] std::string ToJson(const part_alignment::Budget& budget);

/// A camera's parameter and its 95 % interval, to eight digits: distortion has many zeros behind
/// its point.
struct ParameterWords {
  std::string name;
  std::string value;
  std::string interval;
};
/// In the order of kCameraParameterNames.
/// @param covariance  k = 1, of the camera's parameters in that order.
[[nodiscard]] std::vector<ParameterWords> CalibratedParameters(
    const part_alignment::Camera& camera, const part_alignment::CameraCovariance& covariance);

// Several lines each.

[[nodiscard]] std::string CalibrationText(const part_alignment::CameraCalibration& calibration);
[[nodiscard]] std::string PartFitText(const part_alignment::PartFitInput& input,
                                      const part_alignment::PartFit& fit);
[[nodiscard]] std::string BudgetText(const part_alignment::Budget& budget);

}  // namespace trammel::report

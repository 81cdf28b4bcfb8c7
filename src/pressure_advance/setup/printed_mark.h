// The mark that the nozzle prints for its camera: a square of one bead.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/setup/mark_reading.h"

namespace trammel::pressure_advance {

/// Where the mark lies on the bed, and the line beside it by which the nozzle is primed.
struct MarkPlan {
  MarkShape shape;
  double x_mm = 0;  ///< of the square's middle
  double y_mm = 0;
  double run_in_y_mm = 0;  ///< the line runs along x, as far to either side of x_mm
  double run_in_half_mm = 0;
};

/// Where the mark is to lie; absent: as far from the bed's middle to one side as the head stands to
/// the other while it looks at it.
struct MarkPlace {
  std::optional<double> x_mm;
  std::optional<double> y_mm;
};

/// Places mark and run-in on the bed. Errors: kSafety where they do not lie inside the bed's
/// margin.
/// @param camera_x_mm, camera_y_mm  about, from the nozzle to what the camera looks at
[[nodiscard]] Result<MarkPlan> PlanMark(const PatternConfig& config, const MarkPlace& place,
                                        double camera_x_mm, double camera_y_mm);

/// The mark as a file to print: start G-code, run-in, square, idle G-code. Opposite sides are
/// reached from opposite directions, so that the axes' play leaves its middle where it is.
/// REQUIRES config without problems, and temperatures (settings::ValidateTemperatures).
[[nodiscard]] std::string WriteMarkGcode(const MarkPlan& plan, const PatternConfig& config);

/// Without heating and homing.
[[nodiscard]] double MarkTime_s(const MarkPlan& plan, const PatternConfig& config);

}  // namespace trammel::pressure_advance

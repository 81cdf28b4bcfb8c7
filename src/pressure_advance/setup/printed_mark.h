// Mark printed for the camera: a square of one bead.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/setup/mark_reading.h"

namespace trammel::pressure_advance {

/// Place of the mark on the bed, and of the line beside it that primes the nozzle.
struct MarkPlan {
  MarkShape shape;
  double x_mm = 0;  ///< square's centre
  double y_mm = 0;
  double run_in_y_mm = 0;  ///< the line runs along x, as far to either side of x_mm
  double run_in_half_mm = 0;
};

/// Requested place of the mark; absent: opposite the head, which observes it from the same distance
/// to the bed's middle.
struct MarkPlace {
  std::optional<double> x_mm;
  std::optional<double> y_mm;
};

/// Positions mark and run-in on the bed. Errors: kSafety if they exceed the bed's margin.
/// @param camera_x_mm, camera_y_mm  approximate, from the nozzle to the camera's target
[[nodiscard]] Result<MarkPlan> PlanMark(const PatternConfig& config, const MarkPlace& place,
                                        double camera_x_mm, double camera_y_mm);

/// Returns the mark's G-code file: start G-code, run-in, square, idle G-code. Opposite sides are
/// reached from opposite directions, so that backlash does not shift its centre. REQUIRES config
/// without problems, and temperatures (settings::ValidateTemperatures).
[[nodiscard]] std::string WriteMarkGcode(const MarkPlan& plan, const PatternConfig& config);

/// Computes the time without heating and homing.
[[nodiscard]] double MarkTime_s(const MarkPlan& plan, const PatternConfig& config);

}  // namespace trammel::pressure_advance

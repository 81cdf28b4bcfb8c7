// What goes into an alignment beside pixels.
#pragma once

#include "base/result.h"

namespace trammel::part_alignment {

/// Standard uncertainties (k = 1) of what goes into a measurement beside the pixels' own sigmas;
/// all normal, 0: exact.
struct InputUncertainty {
  double machine_mm = 0;  ///< each axis of each view's spindle position, independent
  double target_mm = 0;   ///< each coordinate of each target, the same in all views
  // One value for the whole measurement; counts only where it is not among the unknowns.
  double clamp_angle_rad = 0;
  double clamp_eccentricity_mm = 0;  ///< X and Y each
  double clamp_tilt_rad = 0;         ///< about X and Y each
  double focal_length_mm = 0;
  double camera_offset_mm = 0;  ///< X, Y and Z each
};

/// Errors (kInput) name the field that is negative, not finite or beyond 1000.
[[nodiscard]] Result<void> Validate(const InputUncertainty& inputs);

}  // namespace trammel::part_alignment

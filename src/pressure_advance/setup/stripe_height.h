// Height per pixel and the laser's angle, from the stripe on the bare plate while the head rises.
#pragma once

#include <optional>
#include <span>

#include "base/measured.h"
#include "pressure_advance/setup/observations.h"

namespace trammel::pressure_advance {

struct StripeHeight {
  /// By which the stripe shifts per millimetre that the head rises, at the height asked for: a bead
  /// of that height shifts it as far the other way. Positive along the stripe's normal.
  Measured px_per_height_mm;
  /// Between the laser's plane and the vertical, apart from what the picture's own change of scale
  /// with height adds.
  Measured laser_angle_rad;
  Measured play_z_mm;
  double repeat_mm = 0;  ///< of height, rms
  /// Of the picture, by the bend of the stripe's way; absent where the pictures do not determine
  /// it.
  std::optional<Perspective> perspective;
  /// Where the stripe stands at the height asked for, along its normal from the picture's middle.
  double across_px = 0;
  double across_uncertainty_px = 0;
};

/// Model of a pinhole above a plane, z from the height asked for:
///   across · (1 + z / distance) = scale · (x0 + z · tan angle),
/// linear in scale·x0, scale·tan and 1/distance, which the path's bend tells.
/// @param stripes    at heights on both sides of `height_mm`, some reached from above, some from
///                   below
/// @param px_per_mm  at that height
[[nodiscard]] StripeHeight FitStripeHeight(std::span<const SeenStripe> stripes, double height_mm,
                                           const Measured& px_per_mm, const SetupLimits& limits);

}  // namespace trammel::pressure_advance

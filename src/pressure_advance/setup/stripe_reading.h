// Laser stripe on the bare plate, in one picture.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "base/frame.h"
#include "base/measured.h"
#include "pressure_advance/setup/camera_scale.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

// Height per pixel and the laser's angle, from the stripe on the bare plate while the head rises.

struct StripeHeight {
  /// Shift of the stripe per millimetre of the head's rise, at the requested height: a bead of that
  /// height shifts it as far the other way. Positive along the stripe's normal.
  Measured px_per_height_mm;
  /// Angle between the laser's plane and the vertical, without the contribution of the picture's
  /// change of scale with height.
  Measured laser_angle_rad;
  Measured backlash_z_mm;
  double repeat_mm = 0;  ///< of height, rms
  /// Perspective from the stripe path's curvature; absent if the pictures do not determine it.
  std::optional<Perspective> perspective;
  /// Position of the stripe at the requested height, along its normal from the picture's middle.
  double across_px = 0;
  double across_uncertainty_px = 0;
};

/// Models a pinhole above a plane, z from the given height:
///   across · (1 + z / distance) = scale · (x0 + z · tan angle),
/// linear in scale·x0, scale·tan and 1/distance, which the path's curvature determines.
/// @param stripes    at heights on both sides of `height_mm`, some reached from above, some from
///                   below
/// @param px_per_mm  at that height
[[nodiscard]] StripeHeight FitStripeHeight(std::span<const SeenStripe> stripes, double height_mm,
                                           const Measured& px_per_mm);

/// Position and appearance of a stripe. Positions and sigmas exist only without a fault.
struct StripeReading {
  std::string fault;  ///< why the stripe cannot be measured, with figure and remedy
  bool down = true;   ///< runs down the picture rather than across it
  /// Distance along the stripe's normal (towards larger columns, or rows), from the picture's
  /// centre.
  double across_px = 0;
  double slope = 0;         ///< columns per row (rows per column)
  double width_px = 0;      ///< 1 sigma of the stripe's profile along its normal
  double peak = 0;          ///< grey levels over the background, of the mean profile
  double background = 0;    ///< grey levels beside the stripe
  double saturated_px = 0;  ///< along the normal, in the typical row: width at full scale
};

/// True if a bright line runs down the picture, not across it.
[[nodiscard]] bool StripeRunsDown(const BgrView& frame);

/// Reads the one laser stripe that goes through a picture from side to side.
///
/// The line's centres in all rows give a straight line without those that stand off it (a bead, a
/// glint); the mean profile along it gives the width, by a Gaussian on a constant.
/// Faults: no laser, too little light, light beyond the sensor's scale, a line that is not
/// straight.
/// @param frame  8-bit BGR; smaller than 32 x 32 px is a fault.
/// @param down   as StripeRunsDown tells.
[[nodiscard]] StripeReading ReadStripe(const BgrView& frame, bool down,
                                       vision::LaserLineWorkspace& workspace);

}  // namespace trammel::pressure_advance

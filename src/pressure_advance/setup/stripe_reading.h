// The laser's stripe on the bare plate, as one picture shows it.
#pragma once

#include <string>

#include "base/frame.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

/// Where a stripe stands and how it looks. Positions and sigmas exist only without a fault.
struct StripeReading {
  std::string fault;  ///< why the stripe cannot be measured, with its figure and what to do
  bool down = true;   ///< runs down the picture rather than across it
  /// Along the stripe's normal (towards larger columns, or rows), from the picture's middle.
  double across_px = 0;
  double across_sigma_px = 0;  ///< 1 sigma, of speckle and noise
  /// Column (row where it runs across) at the picture's middle row (column).
  double at_middle_px = 0;
  double slope = 0;     ///< columns per row (rows per column)
  double width_px = 0;  ///< 1 sigma of the stripe's profile along its normal
  double width_sigma_px = 0;
  double peak = 0;          ///< grey levels over the background, of the mean profile
  double background = 0;    ///< grey levels beside the stripe
  double saturated_px = 0;  ///< along the normal, in the typical row: width at full scale
};

/// Whether a bright line runs down the picture or across it.
[[nodiscard]] bool StripeRunsDown(const BgrView& frame);

/// Reads the one laser stripe that goes through a picture from side to side.
///
/// The line's centres in all rows give a straight line without those that stand off it (a bead, a
/// glint); the mean profile along it gives the width, by a Gaussian on a constant. Sigmas come from
/// pieces of the stripe, which do not share their speckle.
/// Faults: no laser, too little light, light beyond the sensor's scale, a line that is not
/// straight.
/// @param frame  8-bit BGR; smaller than 32 x 32 px is a fault.
/// @param down   as StripeRunsDown tells.
[[nodiscard]] StripeReading ReadStripe(const BgrView& frame, bool down,
                                       vision::LaserLineWorkspace& workspace);

}  // namespace trammel::pressure_advance

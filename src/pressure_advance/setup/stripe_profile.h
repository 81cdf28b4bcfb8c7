// The mean profile across a straight stripe.
#pragma once

#include "base/frame.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

struct StripeProfile {
  double sigma_px = 0;              ///< of the Gaussian that fits the profile; 0: none does
  double sigma_uncertainty_px = 0;  ///< 1 sigma, from pieces of the stripe
  double peak = 0;                  ///< grey levels over the background, brightest channel
  double background = 0;            ///< grey levels of that channel beside the stripe
  double saturated_px = 0;          ///< columns at full scale, in the typical row
};

/// Averages the rows of a stripe along the straight line column = offset + slope · row and fits a
/// Gaussian on a constant. The tails (a plate's halo) weigh less than the core.
/// @param model    by which the stripe's light is told from the rest
/// @param about_px  a first guess of its sigma
[[nodiscard]] StripeProfile MeasureProfile(const BgrView& frame, const vision::StripeModel& model,
                                           double offset, double slope, double about_px);

}  // namespace trammel::pressure_advance

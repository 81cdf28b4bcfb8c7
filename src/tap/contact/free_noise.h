// The noise as a free nozzle shows it, where no fit has taken up its slow part.
#pragma once

#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/residuals.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Where the force is the free nozzle's, and what is known of it.
struct FreeNozzle {
  double break_z_mm = 0;
  double latency_s = 0;
  double drift_g_s = 0;  ///< Along the pull-back.
  double level_g = 0;    ///< Just after the break.
  double fitted_s = 0;   ///< How long the force was fitted from the break on.
  double noise_g = 0;    ///< Standard deviation of a sample, as the fit has it.
  MainsHum hum;          ///< That was taken out of the fit.
};

/// Estimates by which correlation of the noise raises the variance of the break, >= 1: the variance
/// of means of neighbouring samples on the free stretches, where no fit has taken up the slow part
/// of the noise, over that of means of white noise (Allan 1966). Means span a fourth and a
/// sixteenth of the press. 1 where the two do not differ significantly, or nothing tells.
/// @param below  Samples in the press.
[[nodiscard]] double FreeNoiseFactor(const CleanTap& clean, const TapMotion& motion,
                                     const FreeNozzle& nozzle, std::size_t below,
                                     Workspace& workspace);

/// By how much the free nozzle's force was higher before the touch than after the break, gf, beyond
/// drift and noise; 0 where the two agree, or nothing tells. A thread of plastic, a cable or a drop
/// that acts only at one of the two moves the break by this over the press's slope.
struct FreeSteps {
  double most = 0;   ///< >= 0
  double least = 0;  ///< <= 0
};
[[nodiscard]] FreeSteps FindFreeSteps(const CleanTap& clean, const TapMotion& motion,
                                      const FreeNozzle& nozzle);

}  // namespace trammel::tap

// The noise as a free nozzle shows it, where no fit has taken up its slow part.
#pragma once

#include "tap/contact/correlated_break.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/residuals.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Where the force is the free nozzle's, and what is known of it.
struct FreeNozzle {
  double break_z_mm = 0;
  double latency_s = 0;
  double drift_g_s = 0;     ///< Along the pull-back.
  double level_g = 0;       ///< Just after the break.
  double fitted_s = 0;      ///< How long the force was fitted from the break on.
  double noise_g = 0;       ///< Standard deviation of a sample, as the fit has it.
  MainsHum hum;             ///< That was taken out of the fit.
  bool correlated = false;  ///< The fit's residuals are.
};

/// By which correlation raises the variance of the break, >= 1: 1 where neither the residuals nor
/// the force before the touch and after the break show any. White noise is taken for correlated in
/// one tap of 40 (five tests, each at one in 200).
[[nodiscard]] double FreeNoiseFactor(const CleanTap& clean, const TapMotion& motion,
                                     const FreeNozzle& nozzle, const BreakFit& fit,
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

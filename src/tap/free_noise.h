// The noise as a free nozzle shows it, where no fit has taken up its slow part.
#pragma once

#include "tap/correlated_break.h"
#include "tap/corruption.h"
#include "tap/motion.h"
#include "tap/residuals.h"
#include "tap/workspace.h"

namespace trammel::tap {

/// Where the force is the free nozzle's, and what is known of it.
struct FreeNozzle {
  double break_z_mm = 0;
  double latency_s = 0;
  double drift_g_s = 0;     ///< Along the pull-back.
  double noise_g = 0;       ///< Standard deviation of a sample, as the fit has it.
  MainsHum hum;             ///< That was taken out of the fit.
  bool correlated = false;  ///< The fit's residuals are.
};

/// By which correlation raises the variance of the break, >= 1: 1 where neither the residuals nor
/// the force before the touch and after the break show any. White noise is taken for correlated in
/// one tap of 70 (three tests, each at one in 200).
[[nodiscard]] double FreeNoiseFactor(const CleanTap& clean, const TapMotion& motion,
                                     const FreeNozzle& nozzle, const BreakFit& fit,
                                     Workspace& workspace);

}  // namespace trammel::tap

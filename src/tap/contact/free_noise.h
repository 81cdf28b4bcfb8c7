// Noise on a free nozzle, where no fit has absorbed its slow part.
#pragma once

#include "tap/contact/correlated_break.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/residuals.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Range and properties of the free nozzle's force.
struct FreeNozzle {
  double break_z_mm = 0;
  double latency_s = 0;
  double drift_g_s = 0;     ///< Along the pull-back.
  double level_g = 0;       ///< Just after the break.
  double fitted_s = 0;      ///< duration of the fit, from the break on
  double noise_g = 0;       ///< Standard deviation of a sample, as the fit has it.
  MainsHum hum;             ///< subtracted from the fit
  bool correlated = false;  ///< The fit's residuals are.
};

/// Computes the variance factor of the break by correlation, >= 1. It is 1 if neither the residuals
/// nor the force before the touch and after the break show any. One white tap in 40 is taken for
/// correlated (five tests, each at one in 200).
[[nodiscard]] double FreeNoiseFactor(const CleanTap& clean, const TapMotion& motion,
                                     const FreeNozzle& nozzle, const BreakFit& fit,
                                     Workspace& workspace);

/// Fall of the free nozzle's force across the tap (before the touch less after the break), gf.
/// Drift and noise are removed; 0 if both agree or nothing determines it. A thread of plastic, a
/// cable or a drop at only one of the two moves the break by this over the press's slope.
struct FreeSteps {
  double most = 0;   ///< >= 0
  double least = 0;  ///< <= 0
};
[[nodiscard]] FreeSteps FindFreeSteps(const CleanTap& clean, const TapMotion& motion,
                                      const FreeNozzle& nozzle);

}  // namespace trammel::tap

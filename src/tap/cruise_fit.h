// The press and its break, fitted to the samples of the pull-back's cruise.
#pragma once

#include "tap/analyse.h"
#include "tap/corruption.h"
#include "tap/motion.h"
#include "tap/press_stretch.h"
#include "tap/stretch_fit.h"
#include "tap/workspace.h"

namespace trammel::tap {

/// Fits press and break, and does what contact.h says about what else the samples do: forgets lone
/// wild samples, fits hum along, trims the press, widens the interval. Each leaves a notice.
///
/// @param stretch  Hum is taken out of its force, the trimmed press from its start.
[[nodiscard]] CruiseFit FitCruise(const CleanTap& clean, const TapMotion& motion,
                                  const TapOptions& options, PressStretch& stretch,
                                  Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap

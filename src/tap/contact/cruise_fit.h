// The press and its break, fitted to the samples of the pull-back's cruise.
#pragma once

#include "tap/contact/press_stretch.h"
#include "tap/contact/stretch_fit.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Fits press and break, and does what contact.h says about what else the samples do: forgets lone
/// wild samples, fits hum along, trims the press, widens the interval. Each leaves a notice.
///
/// @param stretch  Hum is taken out of its force, the trimmed press from its start.
[[nodiscard]] CruiseFit FitCruise(const CleanTap& clean, const TapMotion& motion,
                                  const TapOptions& options, PressStretch& stretch,
                                  Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap

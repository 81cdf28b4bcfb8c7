// Fits press and break to the samples of the pull-back's cruise.
#pragma once

#include "tap/contact/press_stretch.h"
#include "tap/contact/stretch_fit.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Fits press and break, and treats disturbances as in contact.h: ignores lone wild samples, fits
/// hum, trims the press, widens the interval. Each adds a notice.
///
/// @param stretch  Hum is subtracted from its force, the trimmed press cut from its start.
[[nodiscard]] CruiseFit FitCruise(const CleanTap& clean, const TapMotion& motion,
                                  const TapOptions& options, PressStretch& stretch,
                                  Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap

// Fits press and break to a stretch once, with residuals.
#pragma once

#include "tap/contact/break_estimate.h"
#include "tap/contact/press_stretch.h"
#include "tap/samples/residuals.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

struct CruiseFit {
  BreakEstimate estimate;
  PressProfile::Coefficients coefficients;
  ResidualTraits traits;

  [[nodiscard]] bool Found() const { return estimate.outcome == BreakEstimate::Outcome::kFound; }
};

/// Fits the stretch, and sets its residuals if a break is found.
[[nodiscard]] CruiseFit FitStretch(PressStretch& stretch, const BreakTask& task,
                                   Workspace& workspace);

}  // namespace trammel::tap

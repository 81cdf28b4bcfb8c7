// Computes the interval of a contact height: from the break in the force, the latency, and the
// samples' times and steps.
#pragma once

#include "tap/contact/break_estimate.h"
#include "tap/contact/press_stretch.h"
#include "tap/samples/corruption.h"
#include "tap/samples/tap.h"

namespace trammel::tap {

struct ContactInterval {
  double below_mm = 0;                 ///< contact to lower end, >= 0; 95 %
  double above_mm = 0;                 ///< contact to upper end, >= 0; 95 %
  double standard_uncertainty_mm = 0;  ///< k = 1
};

/// Adds to the interval of the break `e`, found in `stretch`, the effects that its fit does not
/// include: the uncertainty of options.latency_s (known, s), times that scatter, held values, steps
/// of the clock and of the converter.
[[nodiscard]] ContactInterval IntervalOf(const CleanTap& clean, const PressStretch& stretch,
                                         const BreakEstimate& e, const TapMotion& motion,
                                         const TapOptions& options);

}  // namespace trammel::tap

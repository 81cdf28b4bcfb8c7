// Estimates the break from parts of the stretch. With a smooth press and a straight baseline they
// agree within the noise; with other effects (ringing, a thread, a step) they do not.
#pragma once

#include "tap/contact/press_profile.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Deviations of the parts' answers below and above the answer of the whole, beyond the noise; both
/// >= 0.
struct LocalReadings {
  double below = 0;
  double above = 0;
};

/// Fits the quadratic press to the half and the quarter of press and baseline next to the break.
/// @param t          Break of the whole stretch.
/// @param noise      Standard deviation of a sample,
/// @param inflation  and factor of correlation on the variance of means.
[[nodiscard]] LocalReadings ReadLocally(const BreakSamples& samples, double t, double noise,
                                        double inflation, Workspace& workspace);

}  // namespace trammel::tap

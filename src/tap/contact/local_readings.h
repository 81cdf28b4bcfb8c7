// The break as parts of the stretch tell it: where a smooth press and a straight baseline hold,
// they agree within the noise; where something else acts (ringing, a thread, a step), they do not.
#pragma once

#include "tap/contact/press_profile.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// By how much the answers of parts lie below and above the answer of the whole, beyond what noise
/// explains; both >= 0.
struct LocalReadings {
  double below = 0;
  double above = 0;
};

/// Fits the quadratic press to the half and the quarter of press and baseline that lie next to the
/// break.
/// @param t          The answer of the whole.
/// @param noise      Standard deviation of a sample,
/// @param inflation  and by which correlation raises the variance of means.
[[nodiscard]] LocalReadings ReadLocally(const BreakSamples& samples, double t, double noise,
                                        double inflation, Workspace& workspace);

}  // namespace trammel::tap

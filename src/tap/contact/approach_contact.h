// Checks the contact by the approach: where it met the bed.
#pragma once

#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Compares the collision on the approach with the break in `result`, as far as the approach was
/// recorded. Adds a notice if they contradict each other. The approach is several times faster and
/// noisier, so it can only be a check.
void CheckApproach(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                   Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap

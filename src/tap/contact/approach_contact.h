// The check from the other side: where the approach met the bed.
#pragma once

#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Compares the collision on the approach with the break in `result`, as far as the approach was
/// recorded, and adds a notice where they contradict each other. The approach is several times
/// faster and noisier, so that it can only be a check.
void CheckApproach(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                   Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap

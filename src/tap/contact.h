// The better contact: one continuous model of force against z around the break.
#pragma once

#include <cstddef>

#include "tap/analyse.h"
#include "tap/motion.h"
#include "tap/workspace.h"

namespace trammel::tap {

/// Bytes that AnalyseContact takes from its workspace at most.
[[nodiscard]] std::size_t ContactWorkspaceBytes(std::size_t samples);

/// @param tap, motion  Passed by CheckInput.
/// @param result       Verdict, reason, contact, uncertainty, noise, points and fit are set.
void AnalyseContact(const TapView& tap, const TapMotion& motion, const TapOptions& options,
                    Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap

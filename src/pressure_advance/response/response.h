// Estimates pressure advance from the zero crossing of the surplus filament of a speed change.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// Fits the response of all lines together.
///
/// The model is conservation of filament, whatever the law of the extruder's lag. A speed change by
/// dv stores S(q_fast) - S(q_slow) more filament, and PA supplies PA * dv of it. The difference is
/// missing from the line (acceleration) or in surplus on it (deceleration). The firmware's
/// smoothing moves filament but adds none, so its shape integrates to zero over the window.
///
/// If lines are read as areas to scale, the law of the lag is estimated from their shapes as well
/// (FitStorage), and weighted with that (WeighWithStorage).
///
/// Assumes one slow-fast-slow change of speed per line, windows that contain the transitions
/// (docs), a reading proportional to the filament near the answer, and independent lines. Checks:
/// the slope's significance, sign and size, the scatter of single lines, the two transitions
/// against each other.
/// @returns an analysis with motion, lines, notices and response; in that, per transition and
///   combined: value in s with its uncertainty (leave-one-out over the lines, plus slip and lag
///   form), or a verdict with the reason.
[[nodiscard]] Analysis FitResponse(const std::vector<LineProfile>& profiles,
                                   const LineMotion& motion, const ResponseOptions& options = {});

/// Runs the response fit and returns all results of the recording in one value.
/// @param deviation  of the heights seen; default-constructed if there are none (a photo)
[[nodiscard]] Analysis Analyse(std::vector<LineProfile> profiles, const LineMotion& motion,
                               DeviationResult deviation, const ResponseOptions& options = {});

}  // namespace trammel::pressure_advance

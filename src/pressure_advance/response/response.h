// Estimates pressure advance where the surplus filament of a speed change crosses zero.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// Fits the response of all lines together.
///
/// Conservation of filament is the whole model: whatever the law of the extruder's lag, a speed
/// change by dv stores S(q_fast) - S(q_slow) more filament, PA supplies PA * dv of it, and the
/// difference is missing from the line (acceleration) or in excess on it (deceleration). Smoothing
/// in the firmware moves filament about but adds none, so its shape integrates to zero over the
/// window.
///
/// Where lines are read as areas to scale, the law of the lag is learnt of their shapes as well
/// (FitLaw), and weighed with that (WeighWithLaw).
///
/// Assumes one slow-fast-slow change of speed per line, windows that hold the transitions (docs), a
/// reading proportional to the filament near the answer, and lines that are independent of each
/// other. Checks: the slope's significance, sign and size, the scatter of single lines, the two
/// transitions against each other.
/// @returns an analysis with motion, lines, notices and response; in that, per transition and
/// combined: value in s with its uncertainty (leave-one-out over the lines, plus slip
///   and lag form), or the verdict that says why not.
[[nodiscard]] Analysis FitResponse(const std::vector<LineProfile>& profiles,
                                   const LineMotion& motion, const ResponseOptions& options = {});

/// Runs the response fit and puts everything known about the recording into one value.
/// @param deviation  of the heights that were seen; default-constructed where there are none (a
/// photo)
[[nodiscard]] Analysis Analyse(std::vector<LineProfile> profiles, const LineMotion& motion,
                               DeviationResult deviation, const ResponseOptions& options = {});

}  // namespace trammel::pressure_advance

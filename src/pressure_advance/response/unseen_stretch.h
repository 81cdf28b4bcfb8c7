// Gaps between the frames of a sweep that keep its line from being read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {

/// Names the stretch of a transition that no frame shows: "no frame shows the line from 17.2 to
/// 21.4 mm". Empty where each window is seen as densely as MeasureExcess asks (kMostUnread), and
/// where the sweep's frames are that far apart throughout: a gap is longer than three usual steps.
/// @param frame_positions_mm  as in ScanLine; at least two of them present, or the answer is empty
/// @param plan                in mm
[[nodiscard]] std::string NameUnseenStretch(
    const std::vector<std::optional<double>>& frame_positions_mm, const TransitionPlan& plan);

}  // namespace trammel::pressure_advance

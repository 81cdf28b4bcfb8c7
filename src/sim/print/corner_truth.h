// True pressure advance of a corner that the nozzle turns without stopping.
#pragma once

#include <span>
#include <vector>

#include "sim/print/bed.h"
#include "sim/print/extruder.h"
#include "sim/print/planner.h"

namespace trammel::sim {

/// Returns the truth of each speed and acceleration at which the highest layer has corners: strokes
/// of two equal arms of one speed, each at least 8 mm long. corner_s is the pressure advance at
/// which the filament laid within 8 mm of the corner, by an extruder without defects and without
/// smoothing, differs least from what was commanded there: least squares along the path.
///
/// With a linear lag it is K*. With a lag that thins with flow it is between the law's slope at the
/// arms' flow and its secant from standstill: a short dip sees the slope, a long one the secant.
[[nodiscard]] std::vector<CornerTruth> CornerTruths(std::span<const TimedMove> plan,
                                                    std::span<const Stroke> strokes,
                                                    const StorageModel& law);

}  // namespace trammel::sim

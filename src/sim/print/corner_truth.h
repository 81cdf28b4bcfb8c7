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
/// which the filament laid within 2.5 mm before and 4 mm behind the corner is what was commanded
/// there, by an extruder without defects.
///
/// With a linear lag it is K* but for the share that smoothing and a lag longer than the window
/// move across the window's ends. With a lag that thins with flow it is between the law's slope at
/// the arms' flow and its secant from standstill: a short dip sees the slope, a long one the
/// secant.
[[nodiscard]] std::vector<CornerTruth> CornerTruths(std::span<const TimedMove> plan,
                                                    std::span<const Stroke> strokes,
                                                    const StorageModel& law);

}  // namespace trammel::sim

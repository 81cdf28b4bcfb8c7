// True pressure advance of a corner that the nozzle turns without stopping.
#pragma once

#include <optional>
#include <span>

#include "sim/print/extruder.h"
#include "sim/print/planner.h"

namespace trammel::sim {

/// Returns the pressure advance at which the filament laid within 2.5 mm before and 4 mm behind a
/// sharp corner is what was commanded there, by an extruder without defects. The corner is that of
/// the last stroke of two equal arms of one speed, each at least 8 mm long; absent without one.
///
/// With a linear lag it is K* but for the share that smoothing and a lag longer than the window
/// move across the window's ends. With a lag that thins with flow it is between the law's slope at
/// the arms' flow and its secant from standstill: a short dip sees the slope, a long one the
/// secant.
[[nodiscard]] std::optional<double> CornerPressureAdvance(std::span<const TimedMove> plan,
                                                          std::span<const Stroke> strokes,
                                                          const StorageModel& law);

}  // namespace trammel::sim

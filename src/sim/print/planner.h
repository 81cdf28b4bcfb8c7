// Converts moves to motion over time: trapezoids with look-ahead, as planned by Klipper.
#pragma once

#include <span>
#include <vector>

#include "sim/print/gcode_interpreter.h"

namespace trammel::sim {

/// Move with its trapezoid. Speeds are along the path (of the filament if only that moves).
struct TimedMove {
  Move move;
  double start_s = 0;  ///< print clock
  double length_mm = 0;
  double start_v_mm_s = 0;
  double cruise_v_mm_s = 0;
  double end_v_mm_s = 0;
  double accelerate_s = 0;
  double cruise_s = 0;
  double decelerate_s = 0;

  [[nodiscard]] double duration_s() const { return accelerate_s + cruise_s + decelerate_s; }
  [[nodiscard]] double end_s() const { return start_s + duration_s(); }
  /// True if there is motion in x or y.
  [[nodiscard]] bool travels() const;
  /// True if there is motion in x or y while filament moves forward: pressure advance applies.
  [[nodiscard]] bool deposits() const { return travels() && move.e_mm > 0; }
};

struct PathState {
  double distance_mm = 0;  ///< from the start of the move
  double speed_mm_s = 0;
};

/// Computes a move's place on its path at a time; clamped to the move's ends.
[[nodiscard]] PathState StateAt(const TimedMove& move, double time_s);

/// Plans all moves. Junction speeds follow Klipper: square corner velocity as junction deviation,
/// the centripetal bound of short moves, rest if the path reverses or one side moves only filament,
/// 1 mm/s of sudden filament speed, minimum cruise ratio. The motion starts at time 0 and rests at
/// each stop_before; dwells are cut to 2 s. Omits moves without any motion.
[[nodiscard]] std::vector<TimedMove> PlanMotion(std::span<const Move> moves);

/// True if a move changes any position, including the filament's.
[[nodiscard]] bool HasMotion(const Move& move);

/// Plans one run that begins at time 0 with a speed and ends at rest, as PlanMotion does between
/// rests; ignores stop_before and dwells. REQUIRES that every move HasMotion, and an entry speed
/// from which the run can come to rest.
[[nodiscard]] std::vector<TimedMove> PlanContinuation(std::span<const Move> moves,
                                                      double entry_v_mm_s);

}  // namespace trammel::sim

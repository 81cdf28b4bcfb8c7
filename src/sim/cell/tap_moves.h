// The trapezoids that Klipper queues along Z for one tap.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"

namespace trammel::sim {

/// z(t) = start_z_mm + z_direction (start_velocity_mm_s dt + acceleration_mm_s2 dt^2 / 2).
struct ZMove {
  double start_time_s = 0;
  double duration_s = 0;  ///< 0: the place is told anew, the head stands
  double start_velocity_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double start_z_mm = 0;
  double z_direction = 0;  ///< -1 down, +1 up, 0 at rest
};

/// How a tap is made. Defaults: recorded taps of a Voron with an HX717.
struct TapMotion {
  double approach_speed_mm_s = 2;   ///< 0.05 … 50
  double acceleration_mm_s2 = 350;  ///< of every start and end, 1 … 1e5
  double approach_from_mm = 1.05;   ///< above the bed, 0.02 … 100
  double trigger_force_g = 75;      ///< 1 … 1e5
  /// From the sample that triggers until the steps end, 0 … 0.5 s.
  double stop_latency_s = 0.008;
  double told_after_s = 0.25;          ///< from the stop to the halt's entry in the queue, 0 … 5
  double pause_s = 0.17;               ///< from there to the pull-back, 0 … 5
  double pull_back_mm = 0.1;           ///< 0.005 … 5
  double pull_back_speed_mm_s = 0.32;  ///< 0.005 … 20; at 320 samples/s 1 um per sample
};

/// Names the field, the value and the bound of the first that cannot be.
[[nodiscard]] Result<void> Validate(const TapMotion& motion);

/// Start and cruise of the approach as they are cut short by the stop at `halt_z_mm`; as Klipper's,
/// the approach has no deceleration. REQUIRES start_z_mm > halt_z_mm.
[[nodiscard]] std::vector<ZMove> ApproachMoves(const TapMotion& motion, double start_time_s,
                                               double start_z_mm, double halt_z_mm);

/// The halt's entry, then start, cruise and end of the pull-back. The cruise vanishes where the
/// pull-back is too short to reach its speed.
[[nodiscard]] std::vector<ZMove> PullBackMoves(const TapMotion& motion, double stop_time_s,
                                               double halt_z_mm);

struct ZState {
  double z_mm = 0;
  double velocity_mm_s = 0;  ///< signed, up is positive
};

/// Before the first move: at its start. Between moves and after them: at rest where the last ended.
/// REQUIRES moves in order of time, not empty.
[[nodiscard]] ZState StateAt(std::span<const ZMove> moves, double time_s);

}  // namespace trammel::sim

// The motion of a tap, read from its moves: where the approach halts, and the pull-back's cruise.
#pragma once

#include <span>

#include "tap/samples/tap.h"

namespace trammel::tap {

/// What the moves say. Files hold four, five or six of them: the approach's acceleration may be
/// missing, and the approach's cruise, as it was queued, may run on past the halt, because homing
/// cut it short. Hence the pull-back is taken as the last upward moves, the press as what comes
/// before it.
struct TapMotion {
  bool has_approach = false;
  double approach_start_s = 0;  ///< Of the cruise downward; nothing to do with the samples' start.
  double approach_speed_mm_s = 0;  ///< > 0
  double approach_start_z_mm = 0;
  double approach_end_s = 0;  ///< When the approach's cruise reaches the halt's height.
  double halt_z_mm = 0;       ///< From where the pull-back starts.

  double pull_back_start_s = 0;
  double cruise_start_s = 0;
  double cruise_end_s = 0;
  double pull_back_end_s = 0;  ///< After the deceleration.
  double cruise_start_z_mm = 0;
  double cruise_end_z_mm = 0;
  double end_z_mm = 0;              ///< After the deceleration.
  double pull_back_speed_mm_s = 0;  ///< > 0

  /// Height on the pull-back's cruise, and on its straight line beyond both ends.
  [[nodiscard]] double CruiseZ(double time_s) const {
    return cruise_start_z_mm + pull_back_speed_mm_s * (time_s - cruise_start_s);
  }
  /// When the cruise passes a height; the inverse of CruiseZ.
  [[nodiscard]] double CruiseTime(double z_mm) const {
    return cruise_start_s + (z_mm - cruise_start_z_mm) / pull_back_speed_mm_s;
  }
  /// Height at any time from the approach's cruise on; flat where nothing moves.
  [[nodiscard]] double Z(double time_s) const;

  double acceleration_mm_s2 = 0;  ///< Of the pull-back's start; 0 where it starts at full speed.
  double deceleration_mm_s2 = 0;  ///< Of its end, > 0; 0 where it ends at full speed.
};

/// @returns a finding with code kNone and `motion` filled, or why the moves hold no tap.
[[nodiscard]] Finding FindMotion(std::span<const Move> moves, TapMotion& motion);

/// More samples than this are no tap: eight minutes at 2000 samples/s.
inline constexpr std::size_t kMostSamples = 1'000'000;
/// As many moves as a queue holds of a few taps.
inline constexpr std::size_t kMostMoves = 1000;

/// Checks sizes, times, numbers and moves, and reads the motion.
/// @returns code kNone where a method may go on. Times that repeat are let through: a method
///          must bear them, and corruption checks say what they mean.
[[nodiscard]] Finding CheckInput(const TapView& tap, TapMotion& motion);

}  // namespace trammel::tap

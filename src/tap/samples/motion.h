// Motion of a tap, derived from its moves: where the approach halts, and the pull-back's cruise.
#pragma once

#include <span>

#include "tap/samples/tap.h"

namespace trammel::tap {

/// Motion read from the moves. Files have four, five or six of them: the approach's acceleration
/// may be missing. The approach's cruise, as queued, may run past the halt, because homing cut it
/// short. Hence the last upward moves are the pull-back, those before it the press.
struct TapMotion {
  bool has_approach = false;
  double approach_start_s = 0;  ///< start of the downward cruise; independent of the samples' start
  double approach_speed_mm_s = 0;  ///< > 0
  double approach_start_z_mm = 0;
  double approach_end_s = 0;  ///< arrival of the approach's cruise at the halt height
  double halt_z_mm = 0;       ///< start of the pull-back

  double pull_back_start_s = 0;
  double cruise_start_s = 0;
  double cruise_end_s = 0;
  double pull_back_end_s = 0;  ///< After the deceleration.
  double cruise_start_z_mm = 0;
  double cruise_end_z_mm = 0;
  double end_z_mm = 0;              ///< After the deceleration.
  double pull_back_speed_mm_s = 0;  ///< > 0

  /// Computes the height on the pull-back's cruise, and on its straight line beyond both ends.
  [[nodiscard]] double CruiseZ(double time_s) const {
    return cruise_start_z_mm + pull_back_speed_mm_s * (time_s - cruise_start_s);
  }
  /// Returns the time at which the cruise passes a height; the inverse of CruiseZ.
  [[nodiscard]] double CruiseTime(double z_mm) const {
    return cruise_start_s + (z_mm - cruise_start_z_mm) / pull_back_speed_mm_s;
  }
  /// Computes the height at any time from the approach's cruise on; flat where nothing moves.
  [[nodiscard]] double Z(double time_s) const;

  double acceleration_mm_s2 = 0;  ///< at the pull-back's start; 0: starts at full speed
  double deceleration_mm_s2 = 0;  ///< at its end, > 0; 0: ends at full speed
};

/// @returns a finding with code kNone and `motion` filled, or why the moves hold no tap.
[[nodiscard]] Finding FindMotion(std::span<const Move> moves, TapMotion& motion);

/// Maximum number of samples of a tap: eight minutes at 2000 samples/s.
inline constexpr std::size_t kMaxSamples = 1'000'000;
/// Most moves: a queue of a few taps.
inline constexpr std::size_t kMaxMoves = 1000;

/// Checks sizes, times, numbers and moves, and derives the motion.
/// @returns code kNone if a method may continue. Repeated times pass: methods must accept them, and
/// corruption checks interpret them.
[[nodiscard]] Finding CheckInput(const TapView& tap, TapMotion& motion);

}  // namespace trammel::tap

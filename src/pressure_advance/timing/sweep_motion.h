// Where the head is at a time, from the list of its moves.
#pragma once

#include <span>

#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::pressure_advance {

/// Position and speed of a head that stands before, between and after its moves.
/// REQUIRES a non-empty list, in order of time. Cost: O(log n).
struct HeadState {
  double position_mm = 0;
  double speed_mm_s = 0;  ///< signed
  bool standing = true;   ///< outside all moves
};
[[nodiscard]] HeadState HeadAt(std::span<const LineMove> moves, double time_s);

/// End of the last move.
[[nodiscard]] double MotionEnd_s(std::span<const LineMove> moves);

/// The largest speed of all moves, without sign.
[[nodiscard]] double LargestSpeed_mm_s(std::span<const LineMove> moves);

/// Whether the head moves at its largest speed, to within a fraction of it, all the time from..to.
[[nodiscard]] bool IsSteady(std::span<const LineMove> moves, double from_s, double to_s,
                            double tolerance);

/// Whether the head stands at some moment from..to.
[[nodiscard]] bool StandsWithin(std::span<const LineMove> moves, double from_s, double to_s);

}  // namespace trammel::pressure_advance

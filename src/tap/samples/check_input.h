// What a recording must be before any method looks at it.
#pragma once

#include "tap/samples/motion.h"
#include "tap/samples/tap.h"

namespace trammel::tap {

/// More samples than this are no tap: eight minutes at 2000 samples/s.
inline constexpr std::size_t kMostSamples = 1'000'000;
/// As many moves as a queue holds of a few taps.
inline constexpr std::size_t kMostMoves = 1000;

/// Checks sizes, times, numbers and moves, and reads the motion.
/// @returns code kNone where a method may go on. Times that repeat are let through: a method
///          must bear them, and corruption checks say what they mean.
[[nodiscard]] Finding CheckInput(const TapView& tap, TapMotion& motion);

}  // namespace trammel::tap

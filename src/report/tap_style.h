// What the figures of taps share.
#pragma once

#include "report/color.h"

namespace trammel::report {

/// The published method and ours, as the write-up colours old and new; told apart in grey too.
inline constexpr Color kOldMethod = Rgb(0xd9631e);
inline constexpr Color kNewMethod = Rgb(0x00734f);
inline constexpr Color kSample = Rgb(0x8a94a3);
inline constexpr double kUmPerMm = 1000;

}  // namespace trammel::report

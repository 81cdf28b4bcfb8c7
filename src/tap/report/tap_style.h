// What the figures of taps share.
#pragma once

#include "document/color.h"

namespace trammel::report {

/// The published method and ours, as the write-up colours old and new; told apart in grey too.
inline constexpr Color kOldMethod = kVermilion;
inline constexpr Color kNewMethod = kGreen;
inline constexpr Color kSample = kGrey;

}  // namespace trammel::report

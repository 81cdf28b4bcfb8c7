// Names of the corners of a force curve.
#pragma once

#include <string_view>

#include "tap/samples/tap.h"

namespace trammel::tap {

/// Returns the name in JSON: "collision".
[[nodiscard]] constexpr std::string_view Name(Corner corner) {
  switch (corner) {
    case Corner::kApproachStart:
      return "approach_start";
    case Corner::kCollision:
      return "collision";
    case Corner::kPressEnd:
      return "press_end";
    case Corner::kDwellEnd:
      return "dwell_end";
    case Corner::kDecompressionSplit:
      return "decompression_split";
    case Corner::kBreak:
      return "break";
    case Corner::kPullBackEnd:
      return "pull_back_end";
  }
  return "unknown";
}

}  // namespace trammel::tap

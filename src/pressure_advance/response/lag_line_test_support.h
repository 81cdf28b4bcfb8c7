// The motion of the lines that tests/support/lag_line prints.
#pragma once

#include "pressure_advance/profile/line_profile.h"
#include "support/lag_line.h"

namespace trammel::pressure_advance {

[[nodiscard]] inline LineMotion MotionOf(const trammel::testing::LagLine& line) {
  return {{{line.slow_before, line.slow_mm_s},
           {1 - line.slow_before - line.slow_after, line.fast_mm_s},
           {line.slow_after, line.slow_mm_s}},
          line.length_mm,
          line.acceleration_mm_s2};
}

}  // namespace trammel::pressure_advance

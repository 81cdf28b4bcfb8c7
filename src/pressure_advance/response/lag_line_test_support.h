// For tests: the motion of the lines that tests/support/lag_line prints, and how a laser reads
// them.
#pragma once

#include <algorithm>

#include "base/random.h"
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

// Reads a printed line without 4 mm at each end. @param noise  of one reading, relative
[[nodiscard]] inline LineProfile ReadLagLine(const trammel::testing::LagLine& line,
                                             const trammel::testing::LagModelTruth& law,
                                             double pressure_advance_s, double noise,
                                             Random& random, double flow = 1) {
  constexpr double kArea_mm2 = 0.11, kEnds_mm = 4;
  const std::vector<double> area = PrintLagLine(line, law, pressure_advance_s);
  LineProfile profile;
  profile.pressure_advance_s = pressure_advance_s;
  for (std::size_t i = 0; i < area.size(); ++i) {
    ProfileSample sample;
    sample.position = line.step_mm * static_cast<double>(i);
    if (sample.position < kEnds_mm || sample.position > line.length_mm - kEnds_mm) continue;
    sample.area = {kArea_mm2 * (flow * area[i] + noise * random.Normal()),
                   kArea_mm2 * std::max(noise, 1e-6)};
    profile.samples.push_back(sample);
  }
  return profile;
}

}  // namespace trammel::pressure_advance

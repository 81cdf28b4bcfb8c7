// A small pattern for the printer's own tests, like the paper's but written by hand.
#pragma once

#include <string>

namespace trammel::sim {

struct TestPattern {
  int lines = 10;
  double last_advance_s = 0.06;  ///< the first line has 0
  double slow_mm_s = 5;
  double fast_mm_s = 150;
  double slow_fraction = 0.25;  ///< at either end
  double length_mm = 30;
  double acceleration_mm_s2 = 3000;
  double filament_per_mm = 0.045899;
  double smooth_time_s = 0.040;
};

/// Lines in +x at x = 100 mm, 4 mm apart from y = 100 mm, with retractions of 0.5 mm.
[[nodiscard]] std::string WriteTestPattern(const TestPattern& pattern);

}  // namespace trammel::sim

// A small pattern for the printer's own tests, like the paper's but written by hand.
#pragma once

#include <cstdint>
#include <string>

#include "base/frame.h"
#include "sim/print/bed.h"

namespace trammel::sim {

struct TestPattern {
  int lines = 10;
  double last_advance_s = 0.06;  ///< the first line has 0
  double slow_mm_s = 5;
  double fast_mm_s = 150;
  double slow_fraction = 0.25;  ///< per end
  double length_mm = 30;
  double acceleration_mm_s2 = 3000;
  double filament_per_mm = 0.045899;
  double smooth_time_s = 0.040;
};

/// Lines in +x at x = 100 mm, 4 mm apart from y = 100 mm, with retractions of 0.5 mm.
[[nodiscard]] std::string WriteTestPattern(const TestPattern& pattern);

/// A straight bead along +x of constant cross-section, sampled every 0.05 mm.
/// Its area is that of the stadium: height (width - height (1 - pi / 4)).
[[nodiscard]] Bed StraightBead(double x0_mm, double x1_mm, double y_mm, double width_mm,
                               double height_mm);

/// Weighted mean column of the red light above `floor` in one row; negative where there is none.
[[nodiscard]] double StripeColumn(const Frame& frame, int row, int floor = 8);

/// Largest red value in a row.
[[nodiscard]] int RedPeak(const Frame& frame, int row);

}  // namespace trammel::sim

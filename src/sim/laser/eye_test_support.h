// What the tests of the eyes share: beds made by hand, and reading pictures back.
#pragma once

#include <cstdint>

#include "base/frame.h"
#include "sim/print/bed.h"

namespace trammel::sim {

/// A straight bead along +x of constant cross-section, sampled every 0.05 mm.
/// Its area is that of the stadium: height (width - height (1 - pi / 4)).
[[nodiscard]] Bed StraightBead(double x0_mm, double x1_mm, double y_mm, double width_mm,
                               double height_mm);

/// Weighted mean column of the red light above `floor` in one row; negative where there is none.
[[nodiscard]] double StripeColumn(const Frame& frame, int row, int floor = 8);

/// Largest red value in a row.
[[nodiscard]] int RedPeak(const Frame& frame, int row);

}  // namespace trammel::sim

// Where the speed changes along photographed lines, found from the lines themselves.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/line_profile.h"

namespace trammel::pressure_advance {

/// Positions of the two speed changes, in line lengths as the profiles count them. They need not be
/// the plan's fractions: a line's first and last bit may lie under the frame.
struct FoundSegments {
  double fast_begin = 0;    ///< the acceleration
  double fast_end = 0;      ///< the deceleration
  double sigma = 0;         ///< 1 sigma of both
  double significance = 0;  ///< of the change of width with PA there, over its scatter elsewhere
};

}  // namespace trammel::pressure_advance

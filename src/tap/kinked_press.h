// The neighbour of the smooth presses that bends at once: something gives way before the bed does.
#pragma once

#include "tap/press_profile.h"

namespace trammel::tap {

/// force = a + b y + c d + k e, d = max(0, t - y), e = max(0, s - y), s < t: two straight presses,
/// as of a sheet that lies hollow.
struct KinkedPress {
  bool found = false;
  double t = 0;            ///< The break,
  double s = 0;            ///< and below it the kink.
  double outer_slope = 0;  ///< Of the press between them; >= 0
  double inner_slope = 0;  ///< and below the kink; >= 0.
  double sum_squares = 0;
};

/// A grid of breaks and kinks, then around its best. Cost: 2 us, whatever the number of samples.
[[nodiscard]] KinkedPress FitKinkedPress(const PressProfile& profile);

}  // namespace trammel::tap

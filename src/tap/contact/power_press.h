// Alternative to the polynomial presses with a softer start: a power law.
#pragma once

#include "tap/contact/press_profile.h"

namespace trammel::tap {

/// Press by a power law: force = a + b y + c d^p, d = max(0, t - y), with p > 1: a round or
/// yielding tip (Hertz: 1.5).
struct PowerPress {
  bool found = false;  ///< False where p would be 1 or less, or nothing was reached.
  double t = 0;
  double standard_deviation = 0;  ///< of t for unit noise, p fitted
  double sum_squares = 0;
  double p = 1;
  double a = 0;
  double b = 0;
  double c = 0;
};

/// Fits by Gauss-Newton from the quadratic press's break, in a handful of passes over the press.
[[nodiscard]] PowerPress FitPowerPress(const PressProfile& profile, double start_t);

}  // namespace trammel::tap

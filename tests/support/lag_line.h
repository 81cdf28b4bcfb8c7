// A one-dimensional printed line with a lagging extruder, for tests of the response fit.
#pragma once

#include <vector>

namespace trammel::testing {

/// S(q), the filament stored at steady flow q: linear * q + power * q^exponent, in mm of line.
struct LagModelTruth {
  double linear_s = 0.036;
  double power = 0;
  double exponent = 0.5;

  [[nodiscard]] double Stored(double q) const;
  /// (S(fast) - S(slow)) / (fast - slow)
  [[nodiscard]] double Secant(double slow, double fast) const;
};

struct LagLine {
  double length_mm = 30;
  double slow_mm_s = 5;
  double fast_mm_s = 150;
  double slow_before = 0.25;  ///< fraction of the line
  double slow_after = 0.25;
  double acceleration_mm_s2 = 3000;
  double smooth_time_s = 0.04;
  bool negative_flow_is_lost = false;  ///< a gap does not get refilled
  double flow_loss_when_fast = 0;      ///< part of the flow, proportional to speed
  double step_mm = 0.2;                ///< spacing of the areas returned
  double footprint_mm = 0.4;
};

/// Area over nominal area at positions 0, step, 2 step … along the line.
[[nodiscard]] std::vector<double> PrintLagLine(const LagLine& line, const LagModelTruth& law,
                                               double pressure_advance_s);

}  // namespace trammel::testing

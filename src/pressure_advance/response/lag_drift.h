// A lag that drifts over the pattern: what the response's slope tells of it.
#pragma once

namespace trammel::pressure_advance {

/// Part of the filament that a speed change moves through a linear lag and that is laid down within
/// the acceleration's window: 1 - lag m(end) / dv, with dm/dt = (acceleration - m / lag).
/// @param lag_s    > 0
/// @param ramp_s   duration of the speed change, > 0
/// @param drain_s  from its end to the window's, at the fast speed; >= 0
/// @returns 0 … 1
[[nodiscard]] double GainOfALinearLag(double lag_s, double ramp_s, double drain_s);

/// Change of the lag over the tested range, relative to that range, as lines in the order of their
/// pressure advance show it: positive where lines with more of it lag more.
struct LagDrift {
  double mean = 0;
  double sigma = 0;  ///< 1 sigma
};

struct LagDriftOptions {
  /// Standard deviation of the drift before the slope is seen: 10 % of the range, that is 20 % of a
  /// lag in its middle; assumed.
  double prior_sigma = 0.1;
  double unseen_sigma = 0.03;  ///< of it, where the slope has no scale to be judged by; assumed
  /// Tail at which the law is taken to thin so much that all filament lands in the window, as a
  /// part of the lag: power laws with exponents of 0.3 to 0.67 have 0.03 to 0.05, linear ones below
  /// 0.01.
  double thinning_tail = 0.04;
};

/// Estimates the drift: a slope of the response other than the gain that the window leaves.
///
/// A drift multiplies the slope by 1 - drift. The gain lies between that of a linear lag and 1;
/// where the tail shows no thinning, near the former.
/// @param slope        of the response, > 0
/// @param slope_sigma  1 sigma
/// @param linear_gain  GainOfALinearLag of the answer
/// @param tail         of the crossing between a shorter window and the whole one, relative to it
[[nodiscard]] LagDrift EstimateLagDrift(double slope, double slope_sigma, double linear_gain,
                                        double tail, const LagDriftOptions& options);

}  // namespace trammel::pressure_advance

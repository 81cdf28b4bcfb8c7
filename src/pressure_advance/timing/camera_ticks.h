// Regular clock of a camera with irregular deliveries.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace trammel::pressure_advance {

/// Camera tick of each frame: its time is origin_s + period_s · tick, where 0 is the earliest
/// arrival of a frame after its capture.
struct TickFit {
  double origin_s = 0;
  double period_s = 0;
  double origin_sigma_s = 0;  ///< for the time of a middle frame
  double period_sigma_s = 0;
  std::vector<long> tick;       ///< per frame, increasing
  std::vector<bool> certain;    ///< per frame
  std::vector<double> delay_s;  ///< per frame: arrival - its tick's time; a few are below 0
  double unevenness_s = 0;      ///< scatter of the earliest deliveries about the line
  double typical_delay_s = 0;   ///< median delay
  std::size_t lost = 0;

  [[nodiscard]] double At(long k) const { return origin_s + period_s * static_cast<double>(k); }
};

/// Fits ticks to arrival times: delivery delays frames (by several periods, if need be) and keeps
/// their order; some frames may be lost. Model: delays are exponential beyond the least one, losses
/// cost 5 nats (one frame in 150); the most likely assignment by dynamic programming over ticks,
/// the line through its tenth-lowest delays (a quantile regression: near the envelope, but not at
/// the mercy of one frame), alternating.
/// @param arrival_s  not decreasing, at least 10.
/// @param nominal_period_s  > 0; what the camera was asked for
/// @param period_s   > 0: fixed; 0: found.
/// @returns a fit without ticks where the arrivals show no rate near any that a camera has.
[[nodiscard]] TickFit FitTicks(std::span<const double> arrival_s, double nominal_period_s,
                               double period_s = 0);

/// Fits one line to the sweeps of one session with a continuously running camera: ten sweeps
/// determine it much better than each alone. If they do not fit one line (a restarted camera), each
/// has its own origin and all have the median of their periods.
/// @param arrivals  per sweep, in order of time; each as for FitTicks().
[[nodiscard]] std::vector<TickFit> FitSessionTicks(std::span<const std::vector<double>> arrivals,
                                                   double nominal_period_s);

/// Fits one sweep whose ticks are the camera's own count.
/// @param tick  per frame, increasing.
[[nodiscard]] TickFit FitKnownTicks(std::span<const double> arrival_s, std::vector<long> tick);

}  // namespace trammel::pressure_advance

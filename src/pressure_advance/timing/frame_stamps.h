// A stamp for every frame, all of them a common latency after the moment at which it was taken.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::pressure_advance {

struct FrameStamp {
  double stamp_s = 0;
  double sigma_s = 0;  ///< against the other stamps of the sweep
  std::size_t lost_before = 0;
  std::string note;  ///< not empty: the stamp cannot be used, and why
};

struct FrameStamps {
  std::vector<FrameStamp> frames;
  double period_s = 0;
  double track_sigma_s = 0;  ///< of the sweep's stamps as a whole, against the other sweeps'
  double clock_sigma_s = 0;  ///< of the relation to the motion's clock
  double jitter_s = 0;       ///< 95 % quantile of the delay of delivery beyond the least
  bool from_capture_times = false;
  bool on_motion_clock = false;  ///< else their zero is unknown
};

/// Stamps from capture times where all sweeps have sound ones, else from a regular clock behind the
/// arrivals. Errors (kMeasurement) carry the reason for refusing.
[[nodiscard]] Result<std::vector<FrameStamps>> StampFrames(std::span<const SweepObservation> sweeps,
                                                           const SweepTimingOptions& options,
                                                           std::vector<std::string>& notices);

}  // namespace trammel::pressure_advance

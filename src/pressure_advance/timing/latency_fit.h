// Delay of a frame's stamp after its capture, from the start and end of the picture's change.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"
#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::pressure_advance {

/// Two consecutive frames and the change between their pictures.
struct ChangePair {
  double from_s = 0;  ///< stamps on the motion's clock, the latency not yet taken off
  double to_s = 0;
  double change = 0;
  std::size_t frame = 0;  ///< the later one
};

struct ChangeTrack {
  std::vector<ChangePair> pairs;
  std::vector<double> stamp_s;  ///< all frames, including those without a pair
  std::span<const LineMove> motion;
  double period_s = 0;
  double stamp_sigma_s = 0;  ///< common to this track's stamps
};

struct LatencySearch {
  double min_s = 0;  ///< the latencies that the clocks allow
  double max_s = 0;
  double beyond_s = 0;  ///< margin around them to search for a contradiction
};

/// Fit's result for one track.
struct TrackFit {
  double still = 0;        ///< change of a standing head
  double moving = 0;       ///< change at the sweep's speed
  double still_sigma = 0;  ///< scatter, as a share of moving - still
  double moving_sigma = 0;
  double own_latency_s = 0;         ///< from this track alone
  double own_gain = 0;              ///< nats by which its own latency is better than the common one
  std::vector<std::size_t> frozen;  ///< frames that repeat the one before though the head moved
};

struct LatencyFit {
  double latency_s = 0;
  double sigma_s = 0;
  double lo95_s = 0;
  double hi95_s = 0;
  std::vector<TrackFit> tracks;
};

/// Errors (kMeasurement) contain the reason: a picture that does not distinguish rest from motion,
/// too few frames of a head at rest, a motion seen at a time that the clocks exclude.
[[nodiscard]] Result<LatencyFit> FitLatency(std::span<const ChangeTrack> tracks,
                                            const LatencySearch& search);

}  // namespace trammel::pressure_advance

// How long before its stamp a frame was taken, from when the picture began and ceased to change.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"
#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::pressure_advance {

/// Two neighbouring frames and the change between their pictures.
struct ChangePair {
  double from_s = 0;  ///< stamps on the motion's clock, the latency not yet taken off
  double to_s = 0;
  double change = 0;
  std::size_t frame = 0;  ///< the later one
};

struct ChangeTrack {
  std::vector<ChangePair> pairs;
  std::vector<double> stamp_s;  ///< of all frames, those without a pair included
  std::span<const LineMove> motion;
  double period_s = 0;
  double stamp_sigma_s = 0;  ///< of this track's stamps as a whole
};

struct LatencySearch {
  double least_s = 0;  ///< the latencies that the clocks allow
  double most_s = 0;
  double beyond_s = 0;  ///< how far around them to look for a contradiction
};

/// One track as the fit sees it.
struct TrackFit {
  double still = 0;        ///< change of a standing head
  double moving = 0;       ///< change at the sweep's speed
  double still_sigma = 0;  ///< scatter, as a share of moving - still
  double moving_sigma = 0;
  double own_latency_s = 0;         ///< of this track alone
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

/// Errors (kMeasurement) carry the reason for refusing: a picture that does not tell standing from
/// moving, too few frames of a standing head, a motion seen at another time than the clocks allow.
[[nodiscard]] Result<LatencyFit> FitLatency(std::span<const ChangeTrack> tracks,
                                            const LatencySearch& search);

}  // namespace trammel::pressure_advance

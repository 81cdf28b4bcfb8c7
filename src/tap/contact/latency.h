// By how much later a force is read than it acted: the way down tells what the way up cannot.
#pragma once

#include "tap/contact/break_estimate.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// What the pull-back told of the press, for heights as the moves have them for an assumed latency.
struct SeenPress {
  PressShape shape;      ///< In units of a stretch from z0_mm, span_mm long,
  double z0_mm = 0;      ///< with
  double span_mm = 0;    ///< this scale,
  double sign = 1;       ///< and this sign of the force that a press adds.
  double latency_s = 0;  ///< The assumed one.
  double noise_g = 0;    ///< Of a sample.
};

struct LatencyEstimate {
  double latency_s = 0;
  double uncertainty_s = 0;  ///< Standard uncertainty.
};

/// Latency from the approach.
///
/// Model: on the way down and at rest the force is the press of the way up at the height where the
/// head was a latency before: force(t) = base + scale P(z(t - latency) + pull_back_speed latency +
/// offset). A latency moves both the touch and the halt; another stiffness (scale) or another
/// height (offset: backlash, friction, creep) moves only one of them. Where the press flattens at
/// its deepest end, the force at rest is a further unknown. Least squares by Gauss and Newton.
///
/// What a user could have is the prior: latencies of 0 to two samples and 5 ms (filters of common
/// converters; transport), offsets of 6 um, scales of 10 %. Where the approach tells nothing, the
/// latency is anywhere in its range alike; where it tells much, a quarter of what it shows the two
/// ways to be apart, 1.5 um at most, remains at both speeds.
[[nodiscard]] LatencyEstimate EstimateLatency(const CleanTap& clean, const TapMotion& motion,
                                              const SeenPress& press);

}  // namespace trammel::tap

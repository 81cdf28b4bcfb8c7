// Latency of the force readings: the way down determines what the way up cannot.
#pragma once

#include "tap/contact/break_estimate.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Press measured on the pull-back, in heights of the moves for an assumed latency.
struct SeenPress {
  PressShape shape;      ///< in units of a stretch from z0_mm, span_mm long,
  double z0_mm = 0;      ///< with
  double span_mm = 0;    ///< this scale,
  double sign = 1;       ///< and this sign of the force that a press adds.
  double latency_s = 0;  ///< The assumed one.
  double noise_g = 0;    ///< per sample
};

struct LatencyEstimate {
  double latency_s = 0;
  double uncertainty_s = 0;  ///< Standard uncertainty.
};

/// Estimates the latency from the approach.
///
/// Model: on the way down and at rest the force is the press of the way up at the head's height a
/// latency before: force(t) = base + scale P(z(t - latency) + pull_back_speed latency + offset). A
/// latency moves both the touch and the halt; another stiffness (scale) or another height (offset:
/// backlash, friction, creep) moves only one of them. If the press flattens at its deepest end, the
/// force at rest is a further unknown. Least squares by Gauss and Newton.
///
/// The prior covers usual set-ups: latencies of 0 to two samples and 5 ms (filters of common
/// converters; transport), offsets of 6 um, scales of 10 %. If the approach has no information, the
/// latency is uniform in its range. If it has much, a quarter of the difference that it shows
/// between the two ways, 1.5 um at most, remains at both speeds.
[[nodiscard]] LatencyEstimate EstimateLatency(const CleanTap& clean, const TapMotion& motion,
                                              const SeenPress& press);

}  // namespace trammel::tap

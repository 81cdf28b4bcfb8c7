// Steps of the clock that stamps the samples.
#pragma once

#include <span>

namespace trammel::tap {

/// By how much the clock stepped, s: sums of its steps forward and backward, both >= 0. Moves are
/// on its time either before or after a step, so that a height read from them is too high by at
/// most the way of `forward_s`, or too low by that of `backward_s`.
struct ClockSteps {
  double forward_s = 0;
  double backward_s = 0;
};

/// Takes steps of the clock out of times: those after a step are put back on the clock before it.
///
/// A converter samples evenly, so that times lie on a grid. Lost samples leave them there; a step
/// moves all that follow off it. Where so many samples are off the grid that times scatter by
/// themselves, and where a sample alone is, no step is seen; nor is one of whole periods, which
/// looks like lost samples.
///
/// @param time_s    In order; may repeat.
/// @param period_s  The median distance.
/// @returns steps as if no sample were lost in them. Cost: one pass without branches where times
/// are even.
[[nodiscard]] ClockSteps TakeOutClockSteps(std::span<float> time_s, double period_s);

}  // namespace trammel::tap

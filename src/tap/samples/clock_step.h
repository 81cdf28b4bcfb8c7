// Corrects steps of the clock that stamps the samples.
#pragma once

#include <span>

namespace trammel::tap {

/// Steps of the clock, s: sums of its steps forward and backward, both >= 0. Moves use its time
/// either before or after a step. A height read from them is too high by at most the way of
/// `forward_s`, or too low by that of `backward_s`.
struct ClockSteps {
  double forward_s = 0;
  double backward_s = 0;
};

/// Removes steps of the clock from times: those after a step are shifted to the clock before it.
///
/// A converter samples evenly, so times are on a grid. Lost samples do not change that; a step
/// moves all that follow off it. A step is not detected where so many samples are off the grid that
/// times scatter by themselves, nor from a single sample, nor if it is of whole periods, which
/// looks like lost samples.
///
/// @param time_s    In order; may repeat.
/// @param period_s  The median distance.
/// @returns steps as if no sample were lost in them. Cost: one pass without branches if times are
/// even.
[[nodiscard]] ClockSteps TakeOutClockSteps(std::span<float> time_s, double period_s);

}  // namespace trammel::tap

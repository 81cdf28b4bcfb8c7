// Faults of the samples themselves, and the samples without them.
#pragma once

#include <cstddef>

#include "tap/samples/clock_step.h"
#include "tap/samples/line_fit.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Samples of a tap on one clock, from two pull-backs before the halt to two after the pull-back's
/// start (the write-up's clip), with their faults. Without samples that repeat a time, are lone and
/// far off, or repeat a value that a slower converter holds.
struct CleanTap {
  bool memory_suffices = true;
  Samples samples;  ///< in the workspace; times from the pull-back's start, forces from origin_g
  double origin_s = 0;
  double origin_g = 0;
  double period_s = 0;     ///< The median distance in time.
  double jitter_s = 0;     ///< Range of the times about even steps, as of evenly spread delays.
  ClockSteps clock_steps;  ///< subtracted from the times
  double step_g = 0;       ///< The least change between neighbours: the converter's step, or less.
  double noise_g = 0;      ///< Of one sample, from the differences of neighbours: white noise.
  /// Medians; NaN if there are no samples.
  double approach_g = 0;   ///< Before the collision.
  double dwell_g = 0;      ///< at rest on the bed
  double departure_g = 0;  ///< from the pull-back's last seventh on

  // Counts of the stretch's samples.
  std::size_t duplicated = 0;            ///< Times that repeat the one before.
  std::size_t duplicated_in_cruise = 0;  ///< in the pull-back
  std::size_t held = 0;                  ///< Values that repeat the one before, and not by chance.
  double held_s = 0;         ///< then: the distance of readings, the maximum extra age of a value
  std::size_t dropped = 0;   ///< Missing, by gaps against the median period.
  double longest_gap_s = 0;  ///< Between neighbours.
  double longest_gap_start_s = 0;  ///< from the pull-back's start
  std::size_t spikes = 0;          ///< Alone far off, up to three in a row.
  std::size_t spikes_in_cruise = 0;
  bool spikes_are_equal = false;    ///< All of one value, as error frames of a converter are.
  std::size_t stuck = 0;            ///< The longest run of one value that noise would not make.
  std::size_t stuck_in_cruise = 0;  ///< of that run, in the pull-back's cruise
  std::size_t saturated = 0;        ///< at a limit of the range, more than noise explains
  std::size_t saturated_in_cruise = 0;
};

/// Returns the maximum workspace of CleanSamples, bytes.
[[nodiscard]] std::size_t CleanWorkspaceBytes(std::size_t samples);

/// @param tap, motion  Passed by CheckInput.
/// Cost: O(samples); 2 us for 400.
[[nodiscard]] CleanTap CleanSamples(const TapView& tap, const TapMotion& motion,
                                    Workspace& workspace);

}  // namespace trammel::tap

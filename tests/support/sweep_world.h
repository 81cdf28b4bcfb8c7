// Sweeps of a camera over a textured line as a test imagines them: when frames are taken, when they
// arrive, and how much each differs from the one before. Shares no model with the code under test.
#pragma once

#include <cstddef>
#include <vector>

#include "base/random.h"

namespace trammel::test {

enum class Delivery {
  kPrompt,   ///< a few tenths of a millisecond
  kUniform,  ///< delays evenly from 0 to jitter_s
  kBursty,   ///< mostly prompt; now and then nothing for up to jitter_s, then all at once
};

struct SweepWorld {
  double period_s = 1.0 / 30;
  double period_error = 3e-4;       ///< of the camera's quartz
  double capture_scatter_s = 3e-4;  ///< of the moments at which frames are taken
  double latency_s = 0.045;         ///< from the exposure's middle to the capture stamp
  double transport_s = 0.004;       ///< from the stamp to the earliest arrival
  Delivery delivery = Delivery::kUniform;
  double jitter_s = 0.05;
  double loss = 0;  ///< probability that a frame is lost
  double exposure_s = 0.01;
  double still_s = 0.6;  ///< recorded before and after the motion, and up to a period more
  double start_mm = 4;
  double end_mm = 26;
  double speed_mm_s = 400.0 / 60;
  double acceleration_mm_s2 = 50;
  double grain_mm = 0.08;  ///< of the texture that the laser crosses
  double noise = 0.15;     ///< of the picture, against the texture's contrast
  double clock_s = 0;      ///< camera's clock minus the motion's
};

struct SweepFrame {
  double true_time_s = 0;  ///< middle of the exposure, on the motion's clock
  double true_position_mm = 0;
  double true_speed_mm_s = 0;
  double arrival_s = 0;  ///< on the motion's clock
  double stamp_s = 0;    ///< on the camera's clock
  unsigned long sequence = 0;
  double change = 0;  ///< against the frame before; of the first frame 0
};

struct WorldSweep {
  double start_s = 0;  ///< of the motion
  std::vector<SweepFrame> frames;
};

/// One sweep that begins to move near `start_s`, with a phase of the camera of its own.
[[nodiscard]] WorldSweep RecordSweep(const SweepWorld& world, double start_s, Random& random);

/// Several, a pause of two seconds between them, seen by one camera that runs through.
[[nodiscard]] std::vector<WorldSweep> RecordSession(const SweepWorld& world, std::size_t sweeps,
                                                    Random& random);

}  // namespace trammel::test

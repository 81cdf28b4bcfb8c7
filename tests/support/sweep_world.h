// A small laser world of the tests' own: sweeps over a bead, and MJPEG files to keep them in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/frame.h"
#include "base/random.h"
#include "support/temporary_folder.h"

namespace trammel::test {

/// Appearance of a sweep. Heights rise towards smaller x.
struct LaserWorld {
  int width = 45;
  int height = 60;
  double plate_column_px = 35;
  double tilt = 0;  ///< columns per row
  double bead_row_px = 30;
  double px_per_mm = 44;
  double stripe_sigma_px = 2;
  double plate_amplitude = 200;
  double bead_amplitude = 90;
  double noise = 2;       ///< grey levels
  double speckle = 0.25;  ///< contrast
  double ambient = 8;
  double highest_mm = 1;  ///< highest bead; additional filament increases only the width
};

/// One frame over a bead of parabolic section, twice as wide as high:
/// area = 2/3 · width · height, up to highest_mm. Nothing is there where area_mm2 is 0.
[[nodiscard]] Frame DrawLaserFrame(const LaserWorld& world, double area_mm2, Random& random);

/// Writes frames as MJPEG in AVI, without an index. They need not be of one size (the header has
/// the first one's). `announced_frames` goes into the header, whatever is true.
void WriteAvi(const std::filesystem::path& path, const std::vector<Frame>& frames,
              std::uint32_t announced_frames);

enum class Delivery {
  kPrompt,   ///< a few tenths of a millisecond
  kUniform,  ///< delays evenly from 0 to jitter_s
  kBursty,   ///< mostly prompt; now and then nothing for up to jitter_s, then all at once
};

struct SweepWorld {
  double period_s = 1.0 / 30;
  double period_error = 3e-4;       ///< of the camera's clock
  double capture_scatter_s = 3e-4;  ///< of capture times
  double latency_s = 0.045;         ///< mid-exposure to capture stamp
  double transport_s = 0.004;       ///< stamp to earliest arrival
  Delivery delivery = Delivery::kUniform;
  double jitter_s = 0.05;
  double loss = 0;  ///< probability that a frame is lost
  double exposure_s = 0.01;
  double still_s = 0.6;  ///< recorded before and after the motion, and up to a period more
  double start_mm = 4;
  double end_mm = 26;
  double speed_mm_s = 400.0 / 60;
  double acceleration_mm_s2 = 50;
  double grain_mm = 0.08;  ///< grain of the texture crossed by the laser
  double noise = 0.15;     ///< picture noise over texture contrast
  double clock_s = 0;      ///< camera's clock minus the motion's
};

struct SweepFrame {
  double true_time_s = 0;  ///< middle of the exposure, on the motion's clock
  double true_position_mm = 0;
  double true_speed_mm_s = 0;
  double arrival_s = 0;  ///< motion's clock
  double stamp_s = 0;    ///< camera's clock
  unsigned long sequence = 0;
  double change = 0;  ///< against the frame before; of the first frame 0
};

struct WorldSweep {
  double start_s = 0;  ///< start of motion
  std::vector<SweepFrame> frames;
};

/// One sweep that begins to move near `start_s`, with a phase of the camera of its own.
[[nodiscard]] WorldSweep RecordSweep(const SweepWorld& world, double start_s, Random& random);

/// Several, a pause of two seconds between them, seen by one camera that runs through.
[[nodiscard]] std::vector<WorldSweep> RecordSession(const SweepWorld& world, std::size_t sweeps,
                                                    Random& random);

}  // namespace trammel::test

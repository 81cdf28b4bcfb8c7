// A small laser world of the tests' own: sweeps over a bead, and MJPEG files to keep them in.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/frame.h"
#include "base/random.h"
#include "support/temporary_folder.h"

namespace trammel::test {

/// How a sweep looks. Heights rise towards smaller x.
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
  double highest_mm = 1;  ///< of a bead; one with more filament grows in width alone
};

/// One frame over a bead of parabolic section, twice as wide as high:
/// area = 2/3 · width · height, up to highest_mm. Nothing is there where area_mm2 is 0.
[[nodiscard]] Frame DrawLaserFrame(const LaserWorld& world, double area_mm2, Random& random);

/// Writes frames as MJPEG in AVI, without an index. They need not be of one size (the header has
/// the first one's). `announced_frames` goes into the header, whatever is true.
void WriteAvi(const std::filesystem::path& path, const std::vector<Frame>& frames,
              std::uint32_t announced_frames);

}  // namespace trammel::test

// How much one picture differs from the one before it: a standing camera from a moving one.
#pragma once

#include <vector>

#include "base/frame.h"

namespace trammel::vision {

struct FrameChangeOptions {
  int block_px = 4;  ///< side of the blocks that are averaged before comparing, 1 … 64: averages
                     ///< noise and JPEG's ringing away
  double strongest_fraction = 0.05;  ///< (0, 1]: the share of blocks that changed most and count; a
                                     ///< laser line covers only a few hundredths of a picture
};

/// A picture reduced to what is compared; reusable storage.
struct FrameSketch {
  int width = 0;                  ///< blocks
  int height = 0;                 ///< blocks
  std::vector<float> brightness;  ///< mean of the blocks, grey levels 0 … 255, row-major
};

/// REQUIRES at least one whole block in each direction. Cost: one pass over the pixels.
void SketchFrame(const BgrView& frame, const FrameChangeOptions& options, FrameSketch& sketch);

/// The change between two pictures: root mean square of the blocks' differences in grey levels,
/// over the strongest_fraction of the blocks, after a common change of gain and brightness
/// (exposure, flicker) was taken out. 0 for the same picture; two pictures of a standing camera
/// differ by their noise only. It grows with the displacement and saturates once the texture has
/// moved by its own grain. REQUIRES sketches of one size.
[[nodiscard]] double FrameChange(const FrameSketch& before, const FrameSketch& after,
                                 const FrameChangeOptions& options, std::vector<float>& scratch);

}  // namespace trammel::vision

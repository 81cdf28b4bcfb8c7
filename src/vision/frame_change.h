// Compares frames of a camera at rest.
#pragma once

#include <cstdint>
#include <vector>

#include "base/frame.h"

namespace trammel::vision {

/// Picture reduced for comparison; reusable storage.
struct FrameSketch {
  int width = 0;                  ///< blocks
  int height = 0;                 ///< blocks
  std::vector<float> brightness;  ///< mean of the blocks, grey levels 0 … 255, row-major
};

/// Averages blocks of 4 x 4 px: noise and JPEG's ringing. REQUIRES at least one block.
void SketchFrame(const BgrView& frame, FrameSketch& sketch);

/// The change between two pictures: root mean square of the blocks' differences in grey levels,
/// over the twentieth of the blocks that changed most (a laser line covers only a few hundredths of
/// a picture), after a common change of gain and brightness (exposure, flicker) was taken out. 0
/// for the same picture; two pictures of a standing camera differ by their noise only. It grows
/// with the displacement and saturates once the texture has moved by its own grain. REQUIRES
/// sketches of one size.
[[nodiscard]] double FrameChange(const FrameSketch& before, const FrameSketch& after,
                                 std::vector<float>& scratch);

/// Sums the frames of a camera at rest before a static scene.
class StillPicture {
 public:
  static constexpr int kMaxFrames = 256;  ///< 8-bit frames that fit a 16-bit sum

  enum class Added { kStill, kMoved, kOtherSize };

  /// Adds a frame unless its content moved since the first one: kMoved if more than a thousandth of
  /// all values (a stripe of 3 px in 1280) differ by more than 24 levels, which exceeds the noise
  /// of a bright stripe and its JPEG. REQUIRES fewer than kMaxFrames so far.
  [[nodiscard]] Added Add(const Frame& frame);

  [[nodiscard]] int frames() const { return frames_; }

  /// Returns the mean, rounded, with the time of the first frame. REQUIRES a frame.
  [[nodiscard]] Frame Mean() const;

 private:
  Frame first_;
  std::vector<std::uint16_t> sum_;
  int frames_ = 0;
};

}  // namespace trammel::vision

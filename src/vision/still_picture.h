// The mean of frames that show the same: the sensor's noise falls, what moves is noticed.
#pragma once

#include <cstdint>
#include <vector>

#include "base/frame.h"

namespace trammel::vision {

/// Sums the frames of a standing camera before a standing scene.
class StillPicture {
 public:
  static constexpr int kMostFrames = 256;  ///< of 8 bits that a sum of 16 holds

  enum class Added { kStill, kMoved, kOtherSize };

  /// Adds a frame unless it shows something elsewhere than the first one did: kMoved where more
  /// than a thousandth of all values (a stripe of 3 px in 1280) differ by more than 24 levels,
  /// which is beyond the noise of a bright stripe and its JPEG. REQUIRES fewer than kMostFrames so
  /// far.
  [[nodiscard]] Added Add(const Frame& frame);

  [[nodiscard]] int frames() const { return frames_; }

  /// The mean, rounded; it carries the time of the first frame. REQUIRES a frame.
  [[nodiscard]] Frame Mean() const;

 private:
  Frame first_;
  std::vector<std::uint16_t> sum_;
  int frames_ = 0;
};

}  // namespace trammel::vision

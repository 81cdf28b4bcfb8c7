// Looks at every frame of a source and marks what cannot be used.
#pragma once

#include <optional>

#include "machine/camera/camera.h"

namespace trammel::machine {

/// Remembers size and time from one frame of a source to the next. Does not decode.
class FrameChecker {
 public:
  /// Fills in width, height, fault and fault_text. A fault that is already set stays.
  void Check(CapturedFrame& frame);

  /// The size of the first sound frame; 0 x 0 before it.
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

 private:
  int width_px_ = 0;
  int height_px_ = 0;
  std::optional<CameraTime> last_;
};

}  // namespace trammel::machine

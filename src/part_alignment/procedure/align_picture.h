// Pictures by a machine that stands.
#pragma once

#include <optional>
#include <stop_token>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "session/frame_recorder.h"

namespace trammel::procedure {

/// A live camera is read all the time, so that what it took during a move is never mistaken for
/// what it took after it.
class StillPictures {
 public:
  /// @param source    must outlive this
  /// @param settle_s  >= 0, between the call and the beginning of a live picture, or its arrival
  ///                  where the camera does not say when it was taken; a recording's are not timed
  StillPictures(machine::FrameSource& source, double settle_s);

  /// Errors: the camera's; kMeasurement for a recording that has come to its end or whose picture
  /// is damaged; kMachine where no sound picture comes for 10 s; kInterrupted.
  [[nodiscard]] Result<machine::CapturedFrame> Take(const std::stop_token& stop);

 private:
  machine::FrameSource& source_;
  double settle_s_;
  std::optional<FrameRecorder> reader_;  ///< of a live camera
  bool times_are_told_ = false;          ///< by this camera, on our clock
};

}  // namespace trammel::procedure

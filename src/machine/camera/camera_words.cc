// Words for the clocks and faults of camera.h.
#include "machine/camera/camera.h"

namespace trammel::machine {

std::string_view ToString(CameraClock clock) {
  switch (clock) {
    case CameraClock::kOurs:
      return "our monotonic clock";
    case CameraClock::kCameraMonotonic:
      return "the camera host's monotonic clock";
    case CameraClock::kCameraWall:
      return "the camera host's wall clock";
    case CameraClock::kRecording:
      return "the recording's clock";
  }
  return "an unknown clock";
}

std::string_view ToString(FrameFault fault) {
  switch (fault) {
    case FrameFault::kNone:
      return "none";
    case FrameFault::kNotAnImage:
      return "not_an_image";
    case FrameFault::kCutOff:
      return "cut_off";
    case FrameFault::kOtherSize:
      return "other_size";
    case FrameFault::kNoSignal:
      return "no_signal";
    case FrameFault::kTimeJumped:
      return "time_jumped";
  }
  return "unknown";
}

}  // namespace trammel::machine

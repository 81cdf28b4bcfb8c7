#include "machine/camera/camera.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "machine/camera/image_file.h"

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

namespace {

void Mark(CapturedFrame& frame, FrameFault fault, std::string text) {
  if (frame.fault != FrameFault::kNone) return;
  frame.fault = fault;
  frame.fault_text = std::move(text);
}

}  // namespace

void FrameChecker::Check(CapturedFrame& frame) {
  const auto header = ReadImageHeader(frame.image);
  if (!header) {
    Mark(frame, FrameFault::kNotAnImage,
         fmt::format("{} bytes that are no picture: {}", frame.image.size(),
                     header.error().message));
  } else {
    frame.width_px = header->width_px;
    frame.height_px = header->height_px;
    if (EndsEarly(frame.image, header->format)) {
      Mark(frame, FrameFault::kCutOff,
           fmt::format("a picture without its end, cut off after {} bytes", frame.image.size()));
    }
  }
  if (frame.fault == FrameFault::kNone && width_px_ == 0) {
    width_px_ = frame.width_px;
    height_px_ = frame.height_px;
  }
  if (frame.fault == FrameFault::kNone &&
      (frame.width_px != width_px_ || frame.height_px != height_px_)) {
    Mark(frame, FrameFault::kOtherSize,
         fmt::format("{}x{} px after frames of {}x{}", frame.width_px, frame.height_px, width_px_,
                     height_px_));
  }
  if (frame.captured && last_ && last_->clock == frame.captured->clock &&
      !(frame.captured->time_s > last_->time_s)) {
    Mark(frame, FrameFault::kTimeJumped,
         fmt::format("its capture time is {:.6f} s after {:.6f} s", frame.captured->time_s,
                     last_->time_s));
  }
  if (frame.captured) last_ = frame.captured;
}

}  // namespace trammel::machine

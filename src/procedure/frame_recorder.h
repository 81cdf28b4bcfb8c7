// Takes a camera's frames as they come, on a thread of its own, and keeps those of one sweep.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "base/result.h"
#include "machine/camera.h"
#include "machine/video_writer.h"

namespace trammel::procedure {

/// Whether the frame says when it was taken, on this machine's monotonic clock.
[[nodiscard]] bool OnOurClock(const machine::CapturedFrame& frame);

/// Reads the camera all the time, so that frames are never late for want of a reader. Between
/// Begin() and End() every frame goes to disk at once and is kept, undecoded.
class FrameRecorder {
 public:
  /// @param stall_s  a camera that sends nothing for so long has stalled: an error for what
  ///                 is being recorded, and none where it goes on before something is.
  FrameRecorder(machine::FrameSource& camera, double stall_s);
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;
  ~FrameRecorder() = default;  // the thread is stopped and joined first: it is the last member

  /// The next sound frame that arrives after this call. Errors: the camera's, kInterrupted, or
  /// kMachine where none comes within the time limit.
  [[nodiscard]] Result<machine::CapturedFrame> NextFrame(double time_limit_s,
                                                         const std::stop_token& stop);

  /// Starts recording into a new video. Errors: those of VideoWriter::Create.
  [[nodiscard]] Result<void> Begin(const std::filesystem::path& video, double frames_per_s);

  /// Waits until the recording holds so many sound frames that were taken after a moment on
  /// HostNow()'s clock, however slowly the camera delivers; at most for the time limit, for then
  /// the camera or the disk is at fault, which End() says.
  void WaitForFrames(std::size_t count, double taken_after_s, double time_limit_s,
                     const std::stop_token& stop);

  /// Ends the recording and gives its frames: those written to the video, in its order. A camera
  /// that failed meanwhile or sent mostly damage, or a disk, is the error; the video keeps what
  /// came before.
  [[nodiscard]] Result<std::vector<machine::CapturedFrame>> End();

 private:
  void Read(const std::stop_token& stop);
  void Take(machine::CapturedFrame frame);  // REQUIRES the lock

  machine::FrameSource& camera_;
  double stall_s_;
  std::mutex mutex_;
  std::condition_variable_any arrived_;
  std::optional<Error> failure_;  // of the camera; final
  std::optional<Error> stall_;    // while recording, or without a frame since
  std::optional<machine::CapturedFrame> latest_;
  std::size_t count_ = 0;  // of sound frames so far
  std::optional<machine::VideoWriter> writer_;
  std::optional<Error> write_failure_;
  std::vector<machine::CapturedFrame> kept_;
  std::size_t damaged_ = 0;  // of this recording
  std::string first_damage_;
  std::string last_damage_;  // of the frames since the last sound one
  std::jthread thread_;
};

}  // namespace trammel::procedure

// Receives a camera's frames on a thread of its own, and stores those of one sweep.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "base/result.h"
#include "base/thread_priority.h"
#include "machine/camera/camera.h"

namespace trammel::procedure {

/// True if the frame has a capture time, on this machine's monotonic clock.
[[nodiscard]] bool OnOurClock(const machine::CapturedFrame& frame);

/// True if the frame is usable: whole, and of the size of those before it.
[[nodiscard]] bool IsSound(const machine::CapturedFrame& frame);

/// Sink of a recording's frames, in order.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  [[nodiscard]] virtual Result<void> Add(const machine::CapturedFrame& frame) = 0;
  [[nodiscard]] virtual Result<void> Finish() = 0;
};

/// Reads the camera all the time, so that frames are never late for lack of a reader: one thread
/// only fetches and stamps them, with raised priority if the system allows it; another writes them
/// to disk. Between Begin() and End() every frame is written and stored, undecoded.
class FrameRecorder {
 public:
  /// @param stall_s  a camera that sends nothing for so long has stalled: an error for what
  ///                 is being recorded, and none where it goes on before something is.
  FrameRecorder(machine::FrameSource& camera, double stall_s);
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;
  ~FrameRecorder() =
      default;  // the threads are stopped and joined first: they are the last members

  /// Returns the next sound frame that arrives after this call. Errors: the camera's, kInterrupted,
  /// or kMachine if none arrives within the time limit.
  [[nodiscard]] Result<machine::CapturedFrame> NextFrame(double time_limit_s,
                                                         const std::stop_token& stop);

  /// Starts recording into a new video. Errors: those of VideoWriter::Create.
  [[nodiscard]] Result<void> Begin(const std::filesystem::path& video, double frames_per_s);
  /// Starts recording into another sink.
  void Begin(std::unique_ptr<FrameSink> sink);

  /// Waits until the recording contains so many sound frames taken after a moment on HostNow()'s
  /// clock, however slow the camera; at most for the time limit. Then the camera or the disk is at
  /// fault, which End() reports.
  void WaitForFrames(std::size_t count, double taken_after_s, double time_limit_s,
                     const std::stop_token& stop);

  /// Ends the recording and returns its frames: those written to the video, in its order. Errors: a
  /// camera that failed meanwhile or sent mostly damage, or a disk that failed or fell behind; the
  /// video contains the frames before.
  [[nodiscard]] Result<std::vector<machine::CapturedFrame>> End();

  /// Returns the scheduling of the thread that fetches frames.
  [[nodiscard]] ThreadPriority priority() const;

 private:
  struct Fetched {
    machine::CapturedFrame frame;
    std::uint64_t number = 0;     // number over all frames, from 1
    std::uint64_t recording = 0;  // active recording; 0: none
  };
  /// Runs a thread's work; an exception becomes the recording's error.
  void Guard(const std::function<void()>& work);
  void Fetch(const std::stop_token& stop);
  void HandOver(std::deque<Fetched>& fetched, std::unique_lock<std::mutex>& lock,
                const std::stop_token& stop);
  void Store(const std::stop_token& stop);
  void Take(Fetched fetched, bool stored);  // REQUIRES the lock
  void Settle(std::unique_lock<std::mutex>& lock);

  machine::FrameSource& camera_;
  double stall_s_;
  std::atomic<std::uint64_t> fetched_ = 0;
  std::atomic<std::uint64_t> recording_ = 0;  // recording of frames fetched now; 0: none
  mutable std::mutex mutex_;                  // never held while anything waits for disk or camera
  std::condition_variable_any changed_;
  ThreadPriority priority_;
  std::deque<Fetched> waiting_;  // to be written to disk
  std::size_t waiting_bytes_ = 0;
  bool storing_ = false;          // a frame is on its way to the disk; the sink is then not ours
  std::optional<Error> failure_;  // camera failure; final
  std::optional<Error> stall_;    // while recording, or without a frame since
  std::optional<machine::CapturedFrame> latest_;
  std::uint64_t latest_number_ = 0;
  std::uint64_t recordings_ = 0;
  std::unique_ptr<FrameSink> sink_;
  std::optional<Error> write_failure_;
  std::vector<machine::CapturedFrame> kept_;
  std::size_t damaged_ = 0;  // in this recording
  std::string first_damage_;
  std::string last_damage_;  // since the last valid frame
  std::jthread store_;
  std::jthread fetch_;
};

}  // namespace trammel::procedure

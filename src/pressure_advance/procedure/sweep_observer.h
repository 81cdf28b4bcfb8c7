// Observes the frames of a sweep while it is recorded.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "machine/camera/camera.h"
#include "pressure_advance/procedure/placed_sweep.h"

namespace trammel::procedure {

/// Does what Observe() does as frames come, on a thread of its own, behind all that keep pace with
/// a machine. What it has not done in the end is left to Observe().
class SweepObserver {
 public:
  SweepObserver();
  SweepObserver(const SweepObserver&) = delete;
  SweepObserver& operator=(const SweepObserver&) = delete;
  ~SweepObserver() = default;  ///< the thread is stopped and joined first: it is the last member

  /// Takes the next frame; returns at once.
  void Add(const machine::CapturedFrame& frame);

  /// Ends at the frame that is being observed. @returns the first frames' observations, in order.
  [[nodiscard]] std::vector<pressure_advance::FrameObservation> Finish();

 private:
  void Work(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<machine::CapturedFrame> waiting_;
  std::size_t waiting_bytes_ = 0;
  bool full_ = false;  // frames were left out: none that come later are observed
  std::vector<pressure_advance::FrameObservation> observed_;
  std::jthread worker_;
};

}  // namespace trammel::procedure

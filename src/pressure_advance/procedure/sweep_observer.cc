#include "pressure_advance/procedure/sweep_observer.h"

#include <utility>

#include "base/bug_note.h"
#include "base/thread_priority.h"

namespace trammel::procedure {

SweepObserver::SweepObserver()
    : worker_([this](const std::stop_token& stop) { (void)NoteBug([&] { Work(stop); }); }) {}

void SweepObserver::Add(const machine::CapturedFrame& frame) {
  constexpr std::size_t kMostWaitingBytes = std::size_t{32} << 20;
  const std::lock_guard lock(mutex_);
  full_ = full_ || waiting_bytes_ + frame.image.size() > kMostWaitingBytes;
  if (full_) return;
  waiting_bytes_ += frame.image.size();
  waiting_.push_back(frame);
  changed_.notify_all();
}

std::vector<pressure_advance::FrameObservation> SweepObserver::Finish() {
  worker_.request_stop();
  if (worker_.joinable()) worker_.join();
  return std::exchange(observed_, {});
}

void SweepObserver::Work(const std::stop_token& stop) {
  LowerThisThread();
  FrameObserver observer;
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); }) &&
         !stop.stop_requested()) {
    const machine::CapturedFrame frame = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= frame.image.size();
    lock.unlock();
    auto seen = observer.Next(frame);
    lock.lock();
    if (!seen) return;  // said by who observes it again
    observed_.push_back(*seen);
  }
}

}  // namespace trammel::procedure

#include "session/frame_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/bug_note.h"
#include "machine/net/host_clock.h"
#include "machine/video/video_writer.h"

namespace trammel::procedure {

using machine::CapturedFrame;
using machine::FrameFault;

namespace {

// Longer than the unreported delays seen from any camera server on a local network.
constexpr double kLongestUntold_s = 0.2;
// Some ten seconds of a camera's pictures; a disk that is further behind will not recover.
constexpr std::size_t kMaxWaitingBytes = std::size_t{96} << 20;
constexpr double kSettle_s = 60;  // for the disk to write the queue

// Returns the earliest possible capture time.
double TakenAfter_s(const CapturedFrame& frame) {
  return OnOurClock(frame) ? frame.captured->time_s : frame.arrival_s - kLongestUntold_s;
}

class VideoSink final : public FrameSink {
 public:
  explicit VideoSink(machine::VideoWriter writer) : writer_(std::move(writer)) {}
  Result<void> Add(const CapturedFrame& frame) override { return writer_.Add(frame); }
  Result<void> Finish() override { return writer_.Finish(); }

 private:
  machine::VideoWriter writer_;
};

Error Changed(const std::string& what) {
  return {
      ErrorKind::kMachine,
      fmt::format("the camera changed its pictures: {}; is it used by somebody else, or did its "
                  "server restart?",
                  what)};
}

}  // namespace

// Two machines booted within seconds of each other are less likely than one machine; in that case,
// the pictures themselves contradict.
bool OnOurClock(const machine::CapturedFrame& frame) {
  constexpr double kLongestDelivery_s = 5;
  constexpr double kGrain_s = 0.002;  // resolution of stamps
  if (!frame.captured) return false;
  if (frame.captured->clock == machine::CameraClock::kOurs) return true;
  const double delay_s = frame.arrival_s - frame.captured->time_s;
  return frame.captured->clock == machine::CameraClock::kCameraMonotonic && delay_s > -kGrain_s &&
         delay_s < kLongestDelivery_s;
}

bool IsSound(const CapturedFrame& frame) {
  return frame.fault == FrameFault::kNone || frame.fault == FrameFault::kTimeJumped;
}

FrameRecorder::FrameRecorder(machine::FrameSource& camera, double stall_s)
    : camera_(camera),
      stall_s_(stall_s),
      store_([this](const std::stop_token& stop) { Guard([&] { Store(stop); }); }),
      fetch_([this](const std::stop_token& stop) { Guard([&] { Fetch(stop); }); }) {}

void FrameRecorder::Guard(const std::function<void()>& work) {
  const auto bug = NoteBug(work);
  if (!bug) return;
  const std::lock_guard lock(mutex_);
  storing_ = false;
  failure_ =
      Error{ErrorKind::kMachine, "a bug in trammel ended the reading of the camera: " + *bug};
  changed_.notify_all();
}

void FrameRecorder::Fetch(const std::stop_token& stop) {
  PriorityWatch watch(RaiseThisThread(ThreadUrgency::kFetching));
  {
    const std::lock_guard lock(mutex_);
    priority_ = watch.Look(machine::HostNow());
  }
  std::deque<Fetched> fetched;
  while (!stop.stop_requested()) {
    const double asked_s = machine::HostNow();
    auto next = camera_.Next(stall_s_, stop);
    std::unique_lock lock(mutex_, std::defer_lock);
    if (next && *next) {
      fetched.push_back({**std::move(next), ++fetched_, recording_});
      // The lock's holder may have lost its processor: the next frame takes this one along.
      if (!camera_.live()) {
        lock.lock();
      } else if (!lock.try_lock()) {
        continue;
      }
      HandOver(fetched, lock, stop);
    } else {
      const bool waited = machine::HostNow() - asked_s >= stall_s_;
      lock.lock();
      HandOver(fetched, lock, stop);
      if (!next && waited) {
        stall_ = next.error();  // the camera may go on; what is being recorded has a hole
      } else {
        failure_ = next ? Error{ErrorKind::kMachine, "the camera's pictures have come to their end"}
                        : next.error();
      }
    }
    const ThreadPriority& priority = watch.Look(machine::HostNow());
    if (priority.raised != priority_.raised) priority_ = priority;
    changed_.notify_all();
    if (failure_) return;
  }
}

void FrameRecorder::HandOver(std::deque<Fetched>& fetched, std::unique_lock<std::mutex>& lock,
                             const std::stop_token& stop) {
  for (Fetched& one : fetched) {
    if (!camera_.live()) {
      changed_.wait(lock, stop, [&] { return waiting_bytes_ < kMaxWaitingBytes; });
    } else if (waiting_bytes_ > kMaxWaitingBytes) {
      if (one.recording != 0 && !write_failure_) {
        write_failure_ =
            Error{ErrorKind::kInput,
                  fmt::format("the disk does not keep up: {} MB of pictures wait to be written; "
                              "record to a faster one, or ask the camera for fewer or smaller "
                              "pictures",
                              waiting_bytes_ >> 20)};
      }
      continue;
    }
    waiting_bytes_ += one.frame.image.size();
    waiting_.push_back(std::move(one));
  }
  fetched.clear();
}

void FrameRecorder::Store(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !waiting_.empty(); })) {
    Fetched fetched = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= fetched.frame.image.size();
    const bool record = sink_ && fetched.recording == recordings_ && !write_failure_;
    if (record) {
      storing_ = true;
      lock.unlock();
      const Result<void> added = sink_->Add(fetched.frame);
      lock.lock();
      storing_ = false;
      if (!added) write_failure_ = added.error();
    }
    Take(std::move(fetched), record && !write_failure_);
    changed_.notify_all();
  }
}

void FrameRecorder::Take(Fetched fetched, bool stored) {
  const CapturedFrame& frame = fetched.frame;
  if (!IsSound(frame)) {
    last_damage_ = frame.fault_text;
    if (stored && damaged_++ == 0) first_damage_ = frame.fault_text;
    if (frame.fault == FrameFault::kOtherSize) failure_ = Changed(frame.fault_text);
    return;
  }
  last_damage_.clear();
  if (!sink_) stall_.reset();
  if (stored) kept_.push_back(frame);
  latest_number_ = fetched.number;
  latest_ = std::move(fetched.frame);
}

// Waits until all fetched frames are processed.
void FrameRecorder::Settle(std::unique_lock<std::mutex>& lock) {
  changed_.wait_for(lock, std::chrono::duration<double>(kSettle_s),
                    [&] { return waiting_.empty() && !storing_; });
}

ThreadPriority FrameRecorder::priority() const {
  const std::lock_guard lock(mutex_);
  return priority_;
}

Result<CapturedFrame> FrameRecorder::NextFrame(double time_limit_s, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const std::uint64_t before = fetched_;
  changed_.wait_for(lock, stop, std::chrono::duration<double>(time_limit_s),
                    [&] { return latest_number_ > before || failure_; });
  if (latest_number_ > before) return *latest_;
  if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
  if (failure_) return tl::unexpected(*failure_);
  if (stall_) return tl::unexpected(*stall_);
  return Fail(fmt::format("no whole picture came from {} within {:.3g} s: {}", camera_.Describe(),
                          time_limit_s,
                          last_damage_.empty() ? "is it used by somebody else?" : last_damage_),
              ErrorKind::kMachine);
}

Result<void> FrameRecorder::Begin(const std::filesystem::path& video, double frames_per_s) {
  auto writer = TRY(machine::VideoWriter::Create(video, frames_per_s));
  Begin(std::make_unique<VideoSink>(std::move(writer)));
  return {};
}

void FrameRecorder::Begin(std::unique_ptr<FrameSink> sink) {
  std::unique_lock lock(mutex_);
  Settle(lock);
  sink_ = std::move(sink);
  write_failure_.reset();
  kept_.clear();
  damaged_ = 0;
  stall_.reset();
  recording_ = ++recordings_;
}

void FrameRecorder::WaitForFrames(std::size_t count, double taken_after_s, double time_limit_s,
                                  const std::stop_token& stop) {
  const auto enough = [&] {
    if (failure_ || stall_ || write_failure_) return true;
    return std::count_if(kept_.begin(), kept_.end(), [&](const CapturedFrame& frame) {
             return TakenAfter_s(frame) >= taken_after_s;
           }) >= static_cast<std::ptrdiff_t>(count);
  };
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, std::chrono::duration<double>(time_limit_s), enough);
}

Result<std::vector<CapturedFrame>> FrameRecorder::End() {
  std::unique_lock lock(mutex_);
  recording_ = 0;
  Settle(lock);
  if (storing_ || !waiting_.empty()) {
    return Fail(fmt::format("the disk takes nothing: a picture has been on its way to it for {} s",
                            kSettle_s));
  }
  Result<void> finished = sink_ ? sink_->Finish() : Result<void>{};
  sink_.reset();
  if (write_failure_) return tl::unexpected(*write_failure_);
  if (failure_) return tl::unexpected(*failure_);
  if (stall_) return tl::unexpected(*stall_);
  if (!finished) return tl::unexpected(finished.error());
  constexpr double kMaxDamaged = 0.2;
  const auto all = static_cast<double>(kept_.size() + damaged_);
  if (static_cast<double>(damaged_) > kMaxDamaged * all) {
    return Fail(
        fmt::format("{} of the camera's {} pictures of this sweep were damaged, the first: {}",
                    damaged_, all, first_damage_),
        ErrorKind::kMachine);
  }
  return std::move(kept_);
}

}  // namespace trammel::procedure

#include "procedure/frame_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "machine/host_clock.h"

namespace trammel::procedure {

using machine::CapturedFrame;
using machine::FrameFault;

namespace {

// Longer than any camera server on a local network was seen to hold a frame without saying so.
constexpr double kLongestUntold_s = 0.2;

// No frame was taken earlier than this.
double TakenAfter_s(const CapturedFrame& frame) {
  return OnOurClock(frame) ? frame.captured->time_s : frame.arrival_s - kLongestUntold_s;
}

Error Changed(const std::string& what) {
  return {
      ErrorKind::kMachine,
      fmt::format("the camera changed its pictures: {}; is it used by somebody else, or did its "
                  "server restart?",
                  what)};
}

}  // namespace

// Two machines that were booted within seconds of each other are less likely than one machine; and
// should it be so, the pictures themselves contradict.
bool OnOurClock(const machine::CapturedFrame& frame) {
  constexpr double kLongestDelivery_s = 5;
  constexpr double kGrain_s = 0.002;  // of the stamps
  if (!frame.captured) return false;
  if (frame.captured->clock == machine::CameraClock::kOurs) return true;
  const double delay_s = frame.arrival_s - frame.captured->time_s;
  return frame.captured->clock == machine::CameraClock::kCameraMonotonic && delay_s > -kGrain_s &&
         delay_s < kLongestDelivery_s;
}

FrameRecorder::FrameRecorder(machine::FrameSource& camera, double stall_s)
    : camera_(camera), stall_s_(stall_s), thread_([this](std::stop_token stop) { Read(stop); }) {}

void FrameRecorder::Read(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const double asked_s = machine::HostNow();
    auto next = camera_.Next(stall_s_, stop);
    const bool waited = machine::HostNow() - asked_s >= stall_s_;
    const std::lock_guard lock(mutex_);
    if (next && *next) {
      Take(**std::move(next));
    } else if (!next && waited) {
      stall_ = next.error();  // the camera may go on; what is being recorded has a hole
    } else {
      failure_ = next ? Error{ErrorKind::kMachine, "the camera's pictures have come to their end"}
                      : next.error();
    }
    arrived_.notify_all();
    if (failure_) return;
  }
}

void FrameRecorder::Take(CapturedFrame frame) {
  if (writer_ && !write_failure_) {
    if (auto added = writer_->Add(frame); !added) write_failure_ = added.error();
  }
  const bool sound = frame.fault == FrameFault::kNone || frame.fault == FrameFault::kTimeJumped;
  if (!sound) {
    last_damage_ = frame.fault_text;
    if (writer_ && damaged_++ == 0) first_damage_ = frame.fault_text;
    if (frame.fault == FrameFault::kOtherSize) failure_ = Changed(frame.fault_text);
    return;
  }
  ++count_;
  last_damage_.clear();
  if (!writer_) stall_.reset();
  if (writer_ && !write_failure_) kept_.push_back(frame);
  latest_ = std::move(frame);
}

Result<CapturedFrame> FrameRecorder::NextFrame(double time_limit_s, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const std::size_t before = count_;
  arrived_.wait_for(lock, stop, std::chrono::duration<double>(time_limit_s),
                    [&] { return count_ > before || failure_; });
  if (count_ > before) return *latest_;
  if (failure_) return tl::unexpected(*failure_);
  if (stall_) return tl::unexpected(*stall_);
  if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
  return Fail(fmt::format("no whole picture came from {} within {:.3g} s: {}", camera_.Describe(),
                          time_limit_s,
                          last_damage_.empty() ? "is it used by somebody else?" : last_damage_),
              ErrorKind::kMachine);
}

Result<void> FrameRecorder::Begin(const std::filesystem::path& video, double frames_per_s) {
  auto writer = machine::VideoWriter::Create(video, frames_per_s);
  if (!writer) return tl::unexpected(writer.error());
  const std::lock_guard lock(mutex_);
  writer_ = std::move(*writer);
  write_failure_.reset();
  kept_.clear();
  damaged_ = 0;
  stall_.reset();
  return {};
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
  arrived_.wait_for(lock, stop, std::chrono::duration<double>(time_limit_s), enough);
}

Result<std::vector<CapturedFrame>> FrameRecorder::End() {
  const std::lock_guard lock(mutex_);
  Result<void> finished = writer_ ? writer_->Finish() : Result<void>{};
  writer_.reset();
  if (write_failure_) return tl::unexpected(*write_failure_);
  if (failure_) return tl::unexpected(*failure_);
  if (stall_) return tl::unexpected(*stall_);
  if (!finished) return tl::unexpected(finished.error());
  constexpr double kMostDamaged = 0.2;
  const auto all = static_cast<double>(kept_.size() + damaged_);
  if (static_cast<double>(damaged_) > kMostDamaged * all) {
    return Fail(
        fmt::format("{} of the camera's {} pictures of this sweep were damaged, the first: {}",
                    damaged_, all, first_damage_),
        ErrorKind::kMachine);
  }
  return std::move(kept_);
}

}  // namespace trammel::procedure

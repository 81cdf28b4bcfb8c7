#include "app/slow_work.h"

#include <fmt/format.h>
#include <malloc.h>

#include <utility>

#include "app/printer_session.h"
#include "base/bug_note.h"

namespace trammel::app {

SlowWork::SlowWork(std::string what, std::chrono::milliseconds first,
                   std::chrono::milliseconds again)
    : what_(std::move(what)), thread_([this, first, again](const std::stop_token& end) {
        (void)NoteBug([&] { Speak(end, first, again); });
      }) {}

void SlowWork::Speak(const std::stop_token& end, std::chrono::milliseconds first,
                     std::chrono::milliseconds again) {
  std::unique_lock lock(mutex_);
  auto waited = std::chrono::milliseconds::zero();
  for (auto wait = first;; wait = again) {
    wake_.wait_for(lock, end, wait, [] { return false; });
    if (end.stop_requested()) return;
    waited += wait;
    const bool is_first = waited == first;
    ShowProgress({is_first ? what_
                           : fmt::format("{}, {:.0f} s so far", what_,
                                         std::chrono::duration<double>(waited).count()),
                  {}});
  }
}

void KeepPicturesMemory() {
  constexpr int kMaxOnHeapBytes = 32 << 20;  // glibc takes no more
  constexpr int kMaxKeptBytes = 256 << 20;
  mallopt(M_MMAP_THRESHOLD, kMaxOnHeapBytes);
  mallopt(M_TRIM_THRESHOLD, kMaxKeptBytes);
}

}  // namespace trammel::app

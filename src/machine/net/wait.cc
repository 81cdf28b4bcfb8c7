#include "machine/net/wait.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>

#include "machine/net/host_clock.h"

namespace trammel::machine {
namespace {

/// Becomes readable when a stop is requested, so that one poll() waits for both.
class StopEvent {
 public:
  StopEvent() : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}
  ~StopEvent() {
    if (fd_ >= 0) close(fd_);
  }
  StopEvent(const StopEvent&) = delete;
  StopEvent& operator=(const StopEvent&) = delete;

  void Signal() const {
    const std::uint64_t one = 1;
    // The write to a fresh eventfd's counter succeeds; a failure has no remedy.
    [[maybe_unused]] const auto written = write(fd_, &one, sizeof one);
  }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

Waited WaitForFd(int fd, short events, double deadline_s, const std::stop_token& stop) {
  if (stop.stop_requested()) return Waited::kStopped;
  const StopEvent event;
  const std::stop_callback on_stop(stop, [&event] { event.Signal(); });
  // If the system has no descriptor for the event, stops are polled ten times a second.
  constexpr double kSlice_s = 0.1;
  for (;;) {
    const double left_s = std::max(0.0, deadline_s - HostNow());
    const double wait_s = event.fd() >= 0 ? std::min(left_s, 3600.0) : std::min(left_s, kSlice_s);
    std::array<pollfd, 2> wanted{pollfd{fd, events, 0}, pollfd{event.fd(), POLLIN, 0}};
    const int ready = poll(wanted.data(), wanted.size(), static_cast<int>(std::ceil(wait_s * 1e3)));
    if (stop.stop_requested()) return Waited::kStopped;
    if (ready > 0 && wanted[0].revents != 0) return Waited::kReady;
    if (ready < 0 && errno != EINTR) return Waited::kReady;
    if (HostNow() >= deadline_s) return Waited::kTimeLimit;
  }
}

}  // namespace trammel::machine

// Waits for a file descriptor, a time limit and a request to stop, whichever comes first.
#pragma once

#include <stop_token>

namespace trammel::machine {

enum class Waited { kReady, kTimeLimit, kStopped };

/// Waits until `fd` is ready for `events` (POLLIN, POLLOUT; an error or hang-up counts as ready:
/// the next call on it reports which), or until `deadline_s` on HostNow()'s clock, or `stop`.
[[nodiscard]] Waited WaitForFd(int fd, short events, double deadline_s,
                               const std::stop_token& stop);

/// Limit of every call that waits for a machine. A call that times out fails with kMachine and
/// names what it waited for; a stopped one fails with kInterrupted at once.
struct WaitLimit {
  double time_limit_s = 10;   ///< from the call, > 0
  std::stop_token stop = {};  ///< one that can never be stopped by default
};

}  // namespace trammel::machine

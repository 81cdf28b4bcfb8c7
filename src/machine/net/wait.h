// Waits for a file descriptor, a time limit and a request to stop, whichever comes first.
#pragma once

#include <stop_token>

namespace trammel::machine {

enum class Waited { kReady, kTimeLimit, kStopped };

/// Waits until `fd` is ready for `events` (POLLIN, POLLOUT; an error or hang-up counts as ready:
/// the next call on it says which), or until `deadline_s` on HostNow()'s clock, or `stop`.
[[nodiscard]] Waited WaitForFd(int fd, short events, double deadline_s,
                               const std::stop_token& stop);

/// Every call that waits for a machine takes one. A call that runs out of time fails with kMachine
/// and names what it waited for; one that is stopped fails with kInterrupted at once.
struct WaitLimit {
  double time_limit_s = 10;   ///< from the call, > 0
  std::stop_token stop = {};  ///< one that can never be stopped by default
};

}  // namespace trammel::machine

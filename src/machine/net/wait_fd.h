// Waiting for a file descriptor, a time limit and a request to stop, whichever comes first.
#pragma once

#include <stop_token>

namespace trammel::machine {

enum class Waited { kReady, kTimeLimit, kStopped };

/// Waits until `fd` is ready for `events` (POLLIN, POLLOUT; an error or hang-up counts as ready:
/// the next call on it says which), or until `deadline_s` on HostNow()'s clock, or `stop`.
[[nodiscard]] Waited WaitForFd(int fd, short events, double deadline_s,
                               const std::stop_token& stop);

}  // namespace trammel::machine

// How long a call may wait, and who may end the wait early.
#pragma once

#include <stop_token>

namespace trammel::machine {

/// Every call that waits for a machine takes one. A call that runs out of time fails with kMachine
/// and names what it waited for; one that is stopped fails with kInterrupted at once.
struct WaitLimit {
  double time_limit_s = 10;   ///< from the call, > 0
  std::stop_token stop = {};  ///< one that can never be stopped by default
};

}  // namespace trammel::machine

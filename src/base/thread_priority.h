// A place before other threads, for those whose only work is to be on time.
#pragma once

#include <string>

namespace trammel {

enum class ThreadUrgency {
  kFetching,  ///< sleeps nearly always, and what it does when it wakes takes less than a
              ///< millisecond
  kWorking,   ///< has much to do, and has to keep pace with the world
};

/// How a thread is scheduled from now on.
struct ThreadPriority {
  bool raised = false;
  std::string text;  ///< "round robin", "nice -10", or why it stayed as it was and what allows more
};

/// Raises the calling thread, and it alone: to the lowest of the real-time priorities where it
/// fetches, else, or where that is not allowed, to nice -10. A computer that prints as well goes on
/// printing: its kernel leaves other threads their share beside such a thread.
ThreadPriority RaiseThisThread(ThreadUrgency urgency);

}  // namespace trammel

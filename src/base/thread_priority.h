// A place before other threads, for those whose only work is to be on time.
#pragma once

#include <string>
#include <utility>

namespace trammel {

enum class ThreadUrgency {
  kFetching,  ///< sleeps nearly always, and what it does when it wakes takes less than a
              ///< millisecond
  kWorking,   ///< has much to do, and has to keep pace with the world
};

/// How a thread is scheduled.
struct ThreadPriority {
  bool raised = false;
  std::string text;  ///< "round robin", "nice -10", or why it is as usual and what allows more
};

/// Raises the calling thread, and it alone: to the lowest of the real-time priorities where it
/// fetches, else, or where that is not allowed, to nice -10.
ThreadPriority RaiseThisThread(ThreadUrgency urgency);

/// Takes a raised priority back from a thread that works instead of sleeping, so that it never
/// keeps a computer that also prints from its work: a camera that floods it with pictures.
class PriorityWatch {
 public:
  /// To be called now and then by the thread that was raised.
  /// @param now_s  a clock that does not go back.
  /// @returns how it is scheduled from now on.
  const ThreadPriority& Look(double now_s);
  explicit PriorityWatch(ThreadPriority priority) : priority_(std::move(priority)) {}

 private:
  ThreadPriority priority_;
  double looked_s_ = 0;  // 0: not yet
  double worked_s_ = 0;  // the thread's own time then
};

}  // namespace trammel

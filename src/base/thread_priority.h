// Raises or lowers the priority of threads, for those whose only work is timing.
#pragma once

#include <string>
#include <utility>

namespace trammel {

enum class ThreadUrgency {
  kFetching,  ///< sleeps nearly always, and what it does when it wakes takes less than a
              ///< millisecond
  kWorking,   ///< has much to do, and has to keep pace with the world
};

/// Scheduling of a thread.
struct ThreadPriority {
  bool raised = false;
  std::string text;  ///< "round robin", "nice -10", or why it is as usual and what allows more
};

/// Raises only the calling thread: one that fetches to the lowest real-time priority; otherwise, or
/// where that is not allowed, to nice -10.
ThreadPriority RaiseThisThread(ThreadUrgency urgency);

/// Revokes the raised priority of a thread that computes instead of sleeping, such as one flooded
/// with pictures by a camera. It must not block a computer that also prints.
class PriorityWatch {
 public:
  /// Checks the scheduling; to be called now and then by the raised thread.
  /// @param now_s  a monotonic clock.
  /// @returns the scheduling from now on.
  const ThreadPriority& Look(double now_s);
  explicit PriorityWatch(ThreadPriority priority) : priority_(std::move(priority)) {}

 private:
  ThreadPriority priority_;
  double looked_s_ = 0;  // 0: not yet
  double worked_s_ = 0;  // the thread's own time then
};

}  // namespace trammel

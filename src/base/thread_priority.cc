#include "base/thread_priority.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace trammel {
namespace {

constexpr int kNice = -10;
constexpr double kMaxShare = 0.5;  // share of a processor; raw 720-line pictures take a sixth
constexpr double kLookEvery_s = 1;

// On Linux each thread has a nice value, set through its thread number.
id_t ThisThread() { return static_cast<id_t>(syscall(SYS_gettid)); }

double WorkedSoFar_s() {
  timespec worked{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &worked);
  return static_cast<double>(worked.tv_sec) + 1e-9 * static_cast<double>(worked.tv_nsec);
}

}  // namespace

ThreadPriority RaiseThisThread(ThreadUrgency urgency) {
  if (urgency == ThreadUrgency::kFetching) {
    sched_param lowest{};
    lowest.sched_priority = sched_get_priority_min(SCHED_RR);
    if (pthread_setschedparam(pthread_self(), SCHED_RR, &lowest) == 0) return {true, "round robin"};
  }
  if (setpriority(PRIO_PROCESS, ThisThread(), kNice) == 0)
    return {true, fmt::format("nice {}", kNice)};
  const int error = errno;
  return {
      false,
      fmt::format(
          "a higher one was refused ({}); a service is allowed it by LimitRTPRIO=1 or LimitNICE={}",
          std::generic_category().message(error), kNice)};
}

const ThreadPriority& PriorityWatch::Look(double now_s) {
  if (!priority_.raised) return priority_;
  const double worked_s = WorkedSoFar_s();
  const double since_s = now_s - looked_s_;
  const bool first = looked_s_ == 0;
  if (!first && since_s < kLookEvery_s) return priority_;
  const double share = (worked_s - worked_s_) / since_s;
  looked_s_ = now_s;
  worked_s_ = worked_s;
  if (first || share < kMaxShare) return priority_;
  const sched_param usual{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &usual);
  setpriority(PRIO_PROCESS, ThisThread(), 0);
  priority_ = {false, fmt::format("a higher one was taken back: it took {:.0f} % of a processor",
                                  100 * share)};
  return priority_;
}

}  // namespace trammel

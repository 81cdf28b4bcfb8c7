#include "base/thread_priority.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace trammel {
namespace {

constexpr int kNice = -10;

}  // namespace

ThreadPriority RaiseThisThread(ThreadUrgency urgency) {
  if (urgency == ThreadUrgency::kFetching) {
    sched_param lowest{};
    lowest.sched_priority = sched_get_priority_min(SCHED_RR);
    if (pthread_setschedparam(pthread_self(), SCHED_RR, &lowest) == 0) return {true, "round robin"};
  }
  // Linux keeps a nice value for each thread, and takes a thread's number for a process's.
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  if (setpriority(PRIO_PROCESS, thread, kNice) == 0) return {true, fmt::format("nice {}", kNice)};
  const int error = errno;
  return {
      false,
      fmt::format(
          "a higher one was refused ({}); a service is allowed it by LimitRTPRIO=1 or LimitNICE={}",
          std::generic_category().message(error), kNice)};
}

}  // namespace trammel

#include "app/shop/sim_serving.h"

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <limits>

#include "app/interrupt.h"

namespace trammel::app {

EndOfServing::EndOfServing() : signals_(EndingSignals()) {
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
}

void EndOfServing::Wait(std::optional<double> for_s, const std::function<bool()>& ended) const {
  constexpr double kLookEveryS = 0.1;
  const auto begin = std::chrono::steady_clock::now();
  const double limit_s = for_s.value_or(std::numeric_limits<double>::infinity());
  for (;;) {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    const double wait_s = std::min(kLookEveryS, limit_s - passed.count());
    if (wait_s <= 0 || (ended && ended())) return;
    timespec limit{};
    limit.tv_nsec = static_cast<long>(wait_s * 1e9);
    if (const int number = sigtimedwait(&signals_, nullptr, &limit);
        number > 0 && number != SIGTTOU)
      return;
  }
}

}  // namespace trammel::app

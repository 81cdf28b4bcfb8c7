#include "app/interrupt.h"

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <limits>

#include "base/bug_note.h"

namespace trammel::app {

sigset_t EndingSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number :
       {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGALRM, SIGUSR1, SIGUSR2, SIGVTALRM, SIGPROF, SIGXCPU,
        SIGSTKFLT, SIGIO, SIGPWR, SIGABRT, SIGTRAP, SIGSYS, SIGTTOU}) {
    sigaddset(&signals, number);
  }
#ifndef TRAMMEL_SANITIZED  // which has handlers of its own for these
  // Signals sent by another process; blocking does not suppress those that this process causes
  // itself.
  for (const int number : {SIGILL, SIGBUS, SIGFPE, SIGSEGV}) sigaddset(&signals, number);
#endif
  for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) sigaddset(&signals, number);
  struct sigaction hang_up {};
  if (sigaction(SIGHUP, nullptr, &hang_up) == 0 && hang_up.sa_handler == SIG_IGN) {
    sigdelset(&signals, SIGHUP);
  }
  return signals;
}

Interrupt::Interrupt() {
  const sigset_t signals = EndingSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // Only blocked, so that output from the background does not stop the process.
  sigset_t ending = signals;
  sigdelset(&ending, SIGTTOU);
  thread_ = std::jthread([source = source_, ending](std::stop_token end) mutable {
    constexpr timespec kLook{0, 100'000'000};
    while (!end.stop_requested()) {
      if (sigtimedwait(&ending, nullptr, &kLook) <= 0) continue;
      (void)NoteBug([] { WaitForNoReaderAnyMore(); });
      source.request_stop();
    }
  });
}

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

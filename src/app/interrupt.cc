#include "app/interrupt.h"

#include <csignal>
#include <ctime>

namespace trammel::app {

Interrupt::Interrupt() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  thread_ = std::jthread([source = source_, signals](std::stop_token end) mutable {
    constexpr timespec kLook{0, 100'000'000};
    while (!end.stop_requested()) {
      if (sigtimedwait(&signals, nullptr, &kLook) > 0) source.request_stop();
    }
  });
}

}  // namespace trammel::app

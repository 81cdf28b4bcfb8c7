// Ctrl-C as a request to stop instead of an immediate end: a moving machine must first be made
// safe.
#pragma once

#include <csignal>
#include <functional>
#include <optional>
#include <stop_token>
#include <thread>

#include "app/console.h"

namespace trammel::app {

/// Returns every signal that can be caught and would end the process: Ctrl-C, a closed terminal, a
/// limit on processor time, a timer. Excludes those that GuardConsole() disables, and SIGHUP if the
/// process was started to outlive its terminal (nohup).
[[nodiscard]] sigset_t EndingSignals();

/// While it lives, every ending signal requests a stop of `token()` instead of ending the process,
/// and no output waits for a reader. Afterwards signals are blocked until the process ends with the
/// matching exit code. REQUIRES that no other thread exists yet, since it would receive the
/// signals.
class Interrupt {
 public:
  Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  ~Interrupt() = default;

  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

 private:
  ConsoleDoesNotWait console_;
  std::stop_source source_;
  std::jthread thread_;  // last: stopped and joined before the source goes
};

/// Blocks the ending signals (app/interrupt.h) so that Wait() receives them. REQUIRES that no other
/// thread exists yet, since it would receive the signals.
class EndOfServing {
 public:
  EndOfServing();

  /// Returns on a signal, after a time, or once `ended` is true (polled ten times a second).
  void Wait(std::optional<double> for_s, const std::function<bool()>& ended = {}) const;

 private:
  ConsoleDoesNotWait console_;
  sigset_t signals_;
};

}  // namespace trammel::app

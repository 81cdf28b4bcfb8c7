// Ctrl-C as a request to stop rather than an end: a machine in motion must be left safe.
#pragma once

#include <csignal>
#include <functional>
#include <optional>
#include <stop_token>
#include <thread>

#include "app/console.h"

namespace trammel::app {

/// Every signal that can be caught and would end the process, whoever sends it: Ctrl-C, a closed
/// terminal, a limit on processor time, a timer. Not those that GuardConsole() has done away with;
/// not SIGHUP where the process was started to outlive its terminal (nohup).
[[nodiscard]] sigset_t EndingSignals();

/// While it lives, the ending signals ask `token()` to stop instead of ending the process, the
/// first like any that come after it, and nothing waits for whoever reads what is said. Then they
/// are held back until the process ends by itself, with the exit code that tells. REQUIRES to be
/// made before any other thread, which would take the signals otherwise.
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

/// Holds the ending signals back (app/interrupt.h), for Wait() to take. REQUIRES to be made before
/// any other thread, which would take the signals otherwise.
class EndOfServing {
 public:
  EndOfServing();

  /// Returns with a signal, when a time has passed, or once `ended` is true (asked ten times a
  /// second).
  void Wait(std::optional<double> for_s, const std::function<bool()>& ended = {}) const;

 private:
  ConsoleDoesNotWait console_;
  sigset_t signals_;
};

}  // namespace trammel::app

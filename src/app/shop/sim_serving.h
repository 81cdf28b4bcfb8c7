// What the virtual printer and its camera share as processes that serve until they are ended.
#pragma once

#include <csignal>
#include <functional>
#include <optional>

#include "app/console.h"

namespace trammel::app {

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

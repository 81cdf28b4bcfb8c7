// What every procedure is given: the printer, a way to be stopped, and somebody to tell.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "machine/printer.h"

namespace trammel::procedure {

/// What is happening now, for a person who watches.
struct Progress {
  std::string text;                   ///< one line, without a full stop
  std::optional<double> remaining_s;  ///< about how long this step takes from now on
};

/// The printer must outlive the session. `stop` is the user's Ctrl-C.
struct Session {
  machine::Printer& printer;
  std::stop_token stop;
  std::function<void(const Progress&)> tell;  ///< may be empty

  void Say(std::string text, std::optional<double> remaining_s = {}) const {
    if (tell) tell({std::move(text), remaining_s});
  }
  [[nodiscard]] machine::WaitLimit Within(double time_limit_s) const {
    return {time_limit_s, stop};
  }
};

/// Waits; false where the session was stopped meanwhile.
[[nodiscard]] bool Pause(double time_s, const std::stop_token& stop);

}  // namespace trammel::procedure

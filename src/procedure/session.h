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
  /// The printer switches laser and heaters off by itself unless KeepAlive is called in time.
  bool has_limit = false;

  void Say(std::string text, std::optional<double> remaining_s = {}) const {
    if (tell) tell({std::move(text), remaining_s});
  }
  [[nodiscard]] machine::WaitLimit Within(double time_limit_s) const {
    return {time_limit_s, stop};
  }
};

/// The macro by which the printer's own limit for laser and heaters begins anew, and the one that
/// ends it (klipper/trammel.cfg).
inline constexpr const char* kKeepAlive = "TRAMMEL_KEEP_ALIVE";
inline constexpr const char* kRelease = "TRAMMEL_RELEASE";

/// Tells the printer that somebody still looks after it. Nothing where it has no limit.
[[nodiscard]] Result<void> KeepAlive(const Session& session);

/// Waits; false where the session was stopped meanwhile.
[[nodiscard]] bool Pause(double time_s, const std::stop_token& stop);

}  // namespace trammel::procedure

// Ctrl-C as a request to stop rather than an end: a machine in motion must be left safe.
#pragma once

#include <stop_token>
#include <thread>

namespace trammel::app {

/// While it lives, SIGINT and SIGTERM ask `token()` to stop instead of ending the process.
/// REQUIRES to be made before any other thread, which would take the signals otherwise.
class Interrupt {
 public:
  Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  ~Interrupt() = default;

  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::jthread thread_;  // last: stopped and joined before the source goes
};

}  // namespace trammel::app

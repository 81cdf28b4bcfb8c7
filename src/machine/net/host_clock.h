// This process's CLOCK_MONOTONIC in seconds: the host time of machine/moonraker/printer.h.
#pragma once

#include <chrono>

namespace trammel::machine {

[[nodiscard]] inline double HostNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace trammel::machine

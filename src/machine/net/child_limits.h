// Bounds of memory and time for a process that decodes what may be hostile.
#pragma once

#include <cstdint>

namespace trammel::machine {

/// Limits the process that calls to so many bytes more than it has, and to a time of computing;
/// meant for a ChildProcess. Under a sanitizer, whose processes have terabytes of addresses, to the
/// time alone.
void LimitThisProcess(std::uint64_t bytes, int seconds);

}  // namespace trammel::machine

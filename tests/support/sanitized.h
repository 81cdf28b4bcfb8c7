// Allowances for a build with sanitizers.
#pragma once

namespace trammel::test {

#ifdef TRAMMEL_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// Factor on a process's time before it counts as stuck.
inline constexpr double kSanitizerSlowdown = kSanitized ? 5 : 1;

/// Factor on its memory: shadows, and freed memory that is retained for a while.
inline constexpr double kSanitizerMemory = kSanitized ? 3 : 1;

}  // namespace trammel::test

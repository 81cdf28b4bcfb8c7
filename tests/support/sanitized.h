// What a build with sanitizers wants otherwise.
#pragma once

namespace trammel::test {

#ifdef TRAMMEL_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// By which a process may take longer before it counts as stuck.
inline constexpr double kSanitizerSlowdown = kSanitized ? 5 : 1;

/// By which it may take more memory: shadows, and what was freed is kept for a while.
inline constexpr double kSanitizerMemory = kSanitized ? 3 : 1;

}  // namespace trammel::test

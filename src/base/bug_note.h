// Keeps what is thrown on a thread from ending the process, and remembers it for main().
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace trammel {

/// Runs a thread's work. What it throws is noted instead of ending the process, which would leave
/// a machine as it is.
/// @returns what was thrown, in words, or nothing where the work came to its end.
[[nodiscard]] std::optional<std::string> NoteBug(const std::function<void()>& work);

/// The first that was noted in this process: main() then ends with the exit code of a bug.
[[nodiscard]] std::optional<std::string> NotedBug();

}  // namespace trammel

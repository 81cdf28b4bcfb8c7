// Prevents a thread's exception from ending the process, and records it for main().
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace trammel {

/// Runs a thread's work. Records an exception instead of ending the process, which would abandon a
/// machine in its current state.
/// @returns the exception's message; absent if the work completed.
[[nodiscard]] std::optional<std::string> NoteBug(const std::function<void()>& work);

/// Returns the first bug noted in this process: main() then ends with the exit code of a bug.
[[nodiscard]] std::optional<std::string> NotedBug();

}  // namespace trammel

// What every fuzz target shares.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

/// Begins the target NAME, a function of one input: (const std::uint8_t* data, std::size_t size).
#define TRAMMEL_FUZZ_TARGET(name)                                                     \
  static int Fuzz_##name(const std::uint8_t* data, std::size_t size);                 \
  static const trammel::fuzz::RegisteredTarget registered_##name(#name, Fuzz_##name); \
  static int Fuzz_##name

namespace trammel::fuzz {

/// Adds a target to the driver's table. Lives as long as the program.
struct RegisteredTarget {
  using Run = int (*)(const std::uint8_t* data, std::size_t size);
  RegisteredTarget(const char* name, Run run);
};

[[nodiscard]] inline std::string_view Text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Ends the process, which both libFuzzer and the replay report as a fault of this input.
inline void Require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

/// An error says something, and is not a copy of a hostile input.
inline void RequireMessage(const Error& error) {
  constexpr std::size_t kLongest = 10'000;
  Require(!error.message.empty(), "an error has a message");
  Require(error.message.size() <= kLongest, "an error's message is short enough to be read");
}

/// Whether there is a value; where there is none, its error must be fit to be shown.
template <class T>
[[nodiscard]] bool Good(const Result<T>& result) {
  if (!result) RequireMessage(result.error());
  return result.has_value();
}

/// Splits an input at lines of "----"; the last part keeps what is left. Missing parts are empty.
[[nodiscard]] inline std::vector<std::string_view> Parts(std::string_view text, std::size_t count) {
  constexpr std::string_view kBetween = "\n----\n";
  std::vector<std::string_view> parts;
  while (parts.size() + 1 < count) {
    const std::size_t end = text.find(kBetween);
    parts.push_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + kBetween.size());
  }
  parts.push_back(text);
  return parts;
}

}  // namespace trammel::fuzz

// Shared code of all fuzz targets.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

/// Begins the target NAME, a function of one input: (std::string_view text).
#define FUZZ_TARGET(name)                                                             \
  static void Fuzz_##name(std::string_view text);                                     \
  static const trammel::fuzz::RegisteredTarget registered_##name(#name, Fuzz_##name); \
  static void Fuzz_##name

namespace trammel::fuzz {

/// Adds a target to the driver's table. Lives as long as the program.
struct RegisteredTarget {
  using Run = void (*)(std::string_view text);
  RegisteredTarget(const char* name, Run run);
};

[[nodiscard]] inline std::span<const std::uint8_t> Bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
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

/// True if there is a value; if not, its error must be fit for display.
template <class T>
[[nodiscard]] bool Good(const Result<T>& result) {
  if (!result) RequireMessage(result.error());
  return result.has_value();
}

/// Takes off the text up to `end`, and `end`; all of it where there is none.
inline std::string_view TakeUntil(std::string_view& text, std::string_view end) {
  const std::size_t at = std::min(text.find(end), text.size());
  const std::string_view taken = text.substr(0, at);
  text.remove_prefix(std::min(at + end.size(), text.size()));
  return taken;
}

/// Splits an input at lines of "----"; the last part has the rest. Missing parts are empty.
[[nodiscard]] inline std::vector<std::string_view> Parts(std::string_view text, std::size_t count) {
  std::vector<std::string_view> parts;
  while (parts.size() + 1 < count) parts.push_back(TakeUntil(text, "\n----\n"));
  parts.push_back(text);
  return parts;
}

/// A file for readers that take a path, without a disk: in a folder of its own, in memory where the
/// system has such a folder. Writing it again replaces its bytes.
class MemoryFile {
 public:
  /// @param name  with the extension that its reader requires
  explicit MemoryFile(const std::string& name);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// Ends the process where the file cannot be written.
  void Write(std::string_view bytes) const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace trammel::fuzz

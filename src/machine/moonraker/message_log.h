// The last messages of a conversation, for reports of what went wrong.
#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::machine {

enum class MessageDirection { kIn, kOut };

/// Keeps the last messages in both directions, cut to a readable length, API keys and tokens
/// blotted out. Thread-safe.
class MessageLog {
 public:
  /// @param capacity  messages kept, >= 1
  explicit MessageLog(std::size_t capacity = 50) : capacity_(capacity) {}

  void Add(MessageDirection direction, std::string_view message);

  /// "> …" for what we sent, "< …" for what came in, oldest first.
  [[nodiscard]] std::vector<std::string> All() const;

  /// The last `count` that are not status updates, indented, each on a line of its own; for the
  /// end of an error message. "" where there are none.
  [[nodiscard]] std::string Excerpt(std::size_t count) const;

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::deque<std::string> messages_;
};

}  // namespace trammel::machine

// Calls over JSON-RPC that wait for their answers, and the last messages exchanged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::machine {

/// JSON-RPC's error code of an unknown method.
inline constexpr int kUnknownMethod = -32601;

/// Answer to one call.
struct RpcAnswer {
  /// kLost: the link broke before the answer. kNotSent: there was no link.
  enum class Kind { kResult, kError, kLost, kNotSent };
  Kind kind = Kind::kResult;
  nlohmann::json result;     ///< kResult only
  int code = 0;              ///< kError only: code of JSON-RPC or HTTP
  std::string message = {};  ///< kError: server's message; otherwise why the connection broke
  double received_s = 0;     ///< host time

  [[nodiscard]] static RpcAnswer Failed(Kind kind, std::string why);
  [[nodiscard]] static RpcAnswer Refused(int code, std::string message);
  [[nodiscard]] static RpcAnswer UnknownMethod(const std::string& method);
};

/// Answers another client's request: kResult or kError, at once. A null result would count as an
/// error.
using RequestHandler =
    std::function<RpcAnswer(const std::string& method, const nlohmann::json& params)>;

/// Numbers calls and passes each its answer, once. Thread-safe; no lock is held during `done`.
class RpcCalls {
 public:
  using Done = std::function<void(RpcAnswer)>;
  /// Message that makes a call.
  struct Message {
    std::int64_t id = 0;
    std::string text;
  };

  /// Registers a call. `params` null: none.
  [[nodiscard]] Message Begin(const std::string& method, nlohmann::json params, Done done);
  /// Passes a result or an error to its call. An answer without a call is dropped; the link's log
  /// has it.
  void TakeAnswer(nlohmann::json message, double received_s);
  /// Ends a call whose message could not be sent, unless it has already ended.
  void NotSent(std::int64_t id, const std::string& why);
  /// Ends all calls, after the link broke.
  void Lose(const std::string& why);

 private:
  /// Removes the call and returns its callback; empty if there is none.
  [[nodiscard]] Done Take(std::int64_t id);

  std::mutex mutex_;
  std::int64_t next_id_ = 1;
  std::map<std::int64_t, Done> waiting_;
};

enum class MessageDirection { kIn, kOut };

/// Stores the last messages in both directions, cut to a readable length, without API keys and
/// tokens. Thread-safe.
class MessageLog {
 public:
  /// @param capacity  messages kept, >= 1
  explicit MessageLog(std::size_t capacity = 50) : capacity_(capacity) {}

  void Add(MessageDirection direction, std::string_view message);

  /// "> …" for what we sent, "< …" for what came in, oldest first.
  [[nodiscard]] std::vector<std::string> All() const;

  /// Returns the last `count` messages except status updates, indented, one a line, for the end of
  /// an error message. "" if there are none.
  [[nodiscard]] std::string Excerpt(std::size_t count) const;

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::deque<std::string> messages_;
};

}  // namespace trammel::machine

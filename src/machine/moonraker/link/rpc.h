// Calls over JSON-RPC that wait for their answers, and the last messages of a conversation.
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

/// JSON-RPC's code of an error: there is no such method.
inline constexpr int kUnknownMethod = -32601;

/// What came back for one call.
struct RpcAnswer {
  /// kLost: the link broke before the answer came. kNotSent: there was none to begin with.
  enum class Kind { kResult, kError, kLost, kNotSent };
  Kind kind = Kind::kResult;
  nlohmann::json result;     ///< with kResult
  int code = 0;              ///< with kError: JSON-RPC's or HTTP's
  std::string message = {};  ///< with kError: the server's words; otherwise how the link broke
  double received_s = 0;     ///< host time

  [[nodiscard]] static RpcAnswer Failed(Kind kind, std::string why);
  [[nodiscard]] static RpcAnswer Refused(int code, std::string message);
  [[nodiscard]] static RpcAnswer UnknownMethod(const std::string& method);
};

/// Answers a request that another client made of us: kResult or kError, at once. A null result
/// would pass for an error.
using RequestHandler =
    std::function<RpcAnswer(const std::string& method, const nlohmann::json& params)>;

/// Numbers calls and gives each its answer, once. Of any thread; no lock is held in a `done`.
class RpcCalls {
 public:
  using Done = std::function<void(RpcAnswer)>;
  /// What to send for a call.
  struct Message {
    std::int64_t id = 0;
    std::string text;
  };

  /// Notes a call. `params` null: none.
  [[nodiscard]] Message Begin(const std::string& method, nlohmann::json params, Done done);
  /// Hands a result or an error to the call that it answers. An answer to nobody is left out: the
  /// link's log has it.
  void TakeAnswer(nlohmann::json message, double received_s);
  /// Ends a call whose message could not be sent, unless it has ended already.
  void NotSent(std::int64_t id, const std::string& why);
  /// Ends all, with the link that their answers would have come over.
  void Lose(const std::string& why);

 private:
  /// The call's, which then waits no more; empty where none does.
  [[nodiscard]] Done Take(std::int64_t id);

  std::mutex mutex_;
  std::int64_t next_id_ = 1;
  std::map<std::int64_t, Done> waiting_;
};

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

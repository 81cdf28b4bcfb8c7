// A small client of the virtual Moonraker for its tests. Shares nothing with the real client.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace trammel::sim {

/// Waits at most ten seconds for anything; throws std::runtime_error that names what it waited for.
class TestClient {
 public:
  using Json = nlohmann::json;
  /// Over a WebSocket; `target` with a token, `api_key` as a header where it is not empty.
  explicit TestClient(std::uint16_t port, const std::string& target = "/websocket",
                      const std::string& api_key = {});
  ~TestClient();

  void SendText(const std::string& text);
  /// Sends a request and gives its number.
  int Send(const std::string& method, const Json& params = nullptr);
  /// The next message; nothing where the server closed the connection.
  [[nodiscard]] std::optional<Json> Next();
  /// The answer to a request; what comes before it is kept in `passed`.
  [[nodiscard]] Json AnswerTo(int id);
  [[nodiscard]] Json Call(const std::string& method, const Json& params = nullptr);
  /// The next notification of this method.
  [[nodiscard]] Json WaitFor(const std::string& method);

  std::vector<Json> passed;

 private:
  struct Wire;
  std::unique_ptr<Wire> wire_;
  int next_id_ = 1;
};

struct TestResponse {
  int status = 0;
  std::string body;
};

/// One HTTP request on a connection of its own.
[[nodiscard]] TestResponse TestHttp(
    std::uint16_t port, const std::string& method, const std::string& target,
    const std::string& body = {},
    const std::vector<std::pair<std::string, std::string>>& headers = {});

}  // namespace trammel::sim

// A server that says what a test tells it to, on a real socket of this machine. It knows nothing of
// printers: what Moonraker says is in the tests and in the recorded conversations.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace trammel::test {

/// Options of the server for new connections.
struct ServerOptions {
  std::string unix_path = {};        ///< listen there instead of on a free port of 127.0.0.1
  std::string certificate_pem = {};  ///< with key_pem: enables TLS
  std::string key_pem = {};
  std::string banner = {};  ///< say this at once instead of HTTP, and nothing more
  bool silent = false;      ///< say nothing at all
  int upgrade_status = 0;   ///< refuse the WebSocket with this HTTP status; 0: accept it
};

struct HttpRequest {
  std::string method;
  std::string target;
  std::string body;
  std::string api_key;  ///< the X-Api-Key header
  std::string content_type;
};

struct HttpAnswer {
  int status = 200;
  std::string body;
};

class ScriptedMoonraker {
 public:
  using Json = nlohmann::json;
  struct State;
  /// Gets a request; what it returns is sent in order. Runs on the server's thread.
  using Handler = std::function<std::vector<Json>(const Json& request)>;

  explicit ScriptedMoonraker(ServerOptions options = {});
  ~ScriptedMoonraker();

  [[nodiscard]] int port() const;

  /// The answer to a method: a result …
  void Answer(const std::string& method, const Json& result);
  /// … an error …
  void AnswerError(const std::string& method, int code, const std::string& message);
  /// … whatever `handler` says (see ResultFor, ErrorFor), or nothing at all.
  void Handle(const std::string& method, Handler handler);
  /// Answers to plain HTTP requests (404 unless set).
  void HandleHttp(std::function<HttpAnswer(const HttpRequest&)> handler);

  /// Sends one text, or any bytes, to every open connection.
  void Push(const Json& message);
  void PushBytes(const std::string& bytes);
  /// Breaks all connections without a goodbye.
  void BreakConnections();

  /// The n-th request of a method (from 1), waiting up to 10 s for it; null where none came.
  [[nodiscard]] Json WaitForRequest(const std::string& method, int n = 1);
  [[nodiscard]] int CountRequests(const std::string& method) const;
  /// The same for a client's answer to a request that was pushed.
  [[nodiscard]] Json WaitForAnswer(const Json& id);
  /// Waits until this many connections were accepted.
  [[nodiscard]] bool WaitForConnections(int count);
  /// Returns the n-th upgrade or plain request, from 1.
  [[nodiscard]] HttpRequest HttpRequestNumber(int n) const;

 private:
  std::unique_ptr<State> state_;
};

[[nodiscard]] nlohmann::json ResultFor(const nlohmann::json& request, const nlohmann::json& result);
[[nodiscard]] nlohmann::json ErrorFor(const nlohmann::json& request, int code,
                                      const std::string& message);
[[nodiscard]] nlohmann::json GcodeResponse(const std::string& line);

/// Lets the server answer identify, server.info, printer.info, objects.list, subscribe, query and
/// scripts ("ok") like a Moonraker whose Klipper is in the given state. The objects are a small
/// printer: homed, an extruder, a bed, a pin "output_pin LASER", a macro LASER_ON.
void AnswerLikeMoonraker(ScriptedMoonraker& server, const std::string& klippy_state = "ready");

/// The status of that small printer.
[[nodiscard]] nlohmann::json SmallPrinterStatus(const std::string& klippy_state = "ready");

/// notify_status_update with these objects.
[[nodiscard]] nlohmann::json StatusUpdate(const nlohmann::json& objects, double eventtime_s);
[[nodiscard]] nlohmann::json Notification(const std::string& method);

}  // namespace trammel::test

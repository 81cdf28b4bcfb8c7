// HTTP and WebSocket server of a panel: limits on what clients send, and the guard before all of
// it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "base/result.h"
#include "panel/guard.h"

namespace trammel::panel {

struct HttpRequest {
  std::string host;                          ///< HostName of the field Host, checked
  std::string method;                        ///< GET, HEAD or POST
  std::string path;                          ///< from the root on, without the query: "/runs/a/b"
  std::map<std::string, std::string> query;  ///< decoded; the first of a name counts
  std::string content_type;                  ///< without parameters, lower case
  std::string body;
};

struct HttpAnswer {
  unsigned status = 200;
  std::string content_type = "application/json";
  std::string body = {};
  std::map<std::string, std::string> fields = {};  ///< besides those of every answer
};

/// Returns an answer with `{"error": message}`.
[[nodiscard]] HttpAnswer HttpError(unsigned status, const std::string& message);

/// Splits a request's target. False: it holds a zero, "..", a control character, or a bad %-escape.
[[nodiscard]] bool ParseTarget(std::string_view target, HttpRequest& request);

/// Functions that answer; called from several threads at once, and may take their time.
struct Answers {
  std::function<HttpAnswer(const HttpRequest&)> http;
  /// Answers a message of a WebSocket at /ws. @returns the text to send back; empty: nothing
  std::function<std::string(std::string_view message)> message;
  /// True for a message that may not wait behind others: a stop. Returns at once.
  std::function<bool(std::string_view message)> is_urgent = {};
};

struct HttpLimits {
  std::size_t header_bytes = 16 << 10;
  std::uint64_t body_bytes = 64 << 20;      ///< a photo of 100 MP has 50 MB
  std::size_t message_bytes = 64 << 10;     ///< of a WebSocket
  std::size_t messages = 20;                ///< of a WebSocket, answered at once
  double header_s = 10;                     ///< for the head of a request, and between requests
  double body_s = 300;                      ///< for its body, over a slow link
  double piece_s = 20;                      ///< for the next bytes of a body or an answer
  std::size_t connections = 200;            ///< at once
  std::size_t connections_of_address = 50;  ///< at once; loopback, where proxies are: all
  std::size_t bodies = 2;                   ///< larger than a megabyte, at once
  std::size_t answer_bytes = 64 << 20;      ///< of all answers that are being written
  std::size_t unread_bytes = 1 << 20;       ///< sent to a WebSocket that does not read: then closed
};

struct HttpServerOptions {
  std::string address = "127.0.0.1";  ///< in numbers
  std::uint16_t port = 0;             ///< 0: any free one
  GuardOptions guard = {};
  HttpLimits limits = {};
};

/// Server on one thread of its own, with some more that answer.
class HttpServer {
 public:
  /// Opens the port. Errors: kInput: the address is none, or the port is taken or not allowed.
  [[nodiscard]] static Result<std::unique_ptr<HttpServer>> Listen(HttpServerOptions options,
                                                                  Answers answers);
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  ~HttpServer();

  [[nodiscard]] std::uint16_t port() const;

  /// Serves until stopped.
  void Run(const std::stop_token& stop);

  /// Sends a text to all WebSockets; thread-safe, does not wait.
  void Broadcast(std::string message);

 private:
  class Impl;
  explicit HttpServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace trammel::panel

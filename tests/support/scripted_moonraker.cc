#include "support/scripted_moonraker.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "support/test_tls.h"

namespace trammel::test {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;

namespace {

/// An accepted connection; everything on the server's thread.
class Session : public std::enable_shared_from_this<Session> {
 public:
  virtual ~Session() = default;
  virtual void Send(std::string bytes) {
    queue_.push_back(std::move(bytes));
    if (queue_.size() == 1) WriteNext();
  }
  virtual void Break() = 0;

 protected:
  // Begins to write bytes, which stay until Written(); nothing before the connection is open.
  virtual void Write(const std::string& bytes) = 0;

  void WriteNext() {
    if (!queue_.empty()) Write(queue_.front());
  }
  // A handler: an error ends the connection.
  template <class Then>
  auto Unless(Then then) {
    return [self = shared_from_this(), then](error_code error, auto... size) {
      if (!error) then(size...);
    };
  }
  auto Written() {
    return Unless([this](std::size_t) {
      queue_.pop_front();
      WriteNext();
    });
  }

 private:
  std::deque<std::string> queue_;
};

using asio::ip::tcp;
using Json = nlohmann::json;

constexpr std::chrono::seconds kPatience{10};

}  // namespace

struct ScriptedMoonraker::State {
  explicit State(ServerOptions the_options) : options(std::move(the_options)) {}

  void Accepted(const std::shared_ptr<Session>& session) {
    const std::lock_guard lock(mutex);
    sessions.push_back(session);
    ++accepted;
    changed.notify_all();
  }

  template <class Does>
  void Each(Does does) {
    for (const auto& weak : sessions) {
      if (const auto session = weak.lock()) does(*session);
    }
  }

  int NoteHttp(const HttpRequest& request) {
    const std::lock_guard lock(mutex);
    http_requests.push_back(request);
    return options.upgrade_status;
  }

  /// Answers one text of a client.
  void OnText(Session& session, const std::string& text) {
    const Json request = Json::parse(text, nullptr, false);
    if (!request.is_object()) return;
    if (!request.contains("method")) {
      const std::lock_guard lock(mutex);
      answers.push_back(request);
      changed.notify_all();
      return;
    }
    Handler handler;
    std::shared_ptr<const std::string> result;
    {
      const std::lock_guard lock(mutex);
      requests.push_back(request);
      changed.notify_all();
      const auto method = request["method"].get<std::string>();
      const auto known = results.find(method);
      if (known != results.end()) result = known->second;
      const auto found = handlers.find(method);
      if (found != handlers.end()) handler = found->second;
    }
    if (result) {
      const std::string id = request.value("id", Json()).dump();
      return session.Send(R"({"id":)" + id + R"(,"jsonrpc":"2.0","result":)" + *result + "}");
    }
    const std::vector<Json> replies =
        handler ? handler(request)
                : std::vector<Json>{ErrorFor(request, -32601, "Method not found")};
    for (const Json& answer : replies) session.Send(answer.dump());
  }

  ServerOptions options;
  asio::io_context io;
  std::unique_ptr<TlsRelay> tls;
  std::unique_ptr<tcp::acceptor> tcp_acceptor;
  std::unique_ptr<asio::local::stream_protocol::acceptor> unix_acceptor;
  std::thread thread;

  mutable std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, Handler> handlers;
  /// Results of methods without a handler, as texts: a large one is written once.
  std::map<std::string, std::shared_ptr<const std::string>> results;
  std::function<HttpAnswer(const HttpRequest&)> http_handler;
  std::vector<Json> requests;
  std::vector<Json> answers;  // from the client
  std::vector<HttpRequest> http_requests;
  std::list<std::weak_ptr<Session>> sessions;
  int accepted = 0;
};

namespace {

/// HTTP and, after an upgrade, WebSocket.
class WebSession : public Session {
 public:
  WebSession(ScriptedMoonraker::State& server, asio::ip::tcp::socket socket)
      : server_(server), socket_(std::move(socket)) {}

  void Start() {
    if (server_.options.silent) {
      held_ = shared_from_this();
      return;
    }
    if (!server_.options.banner.empty()) {
      held_ = shared_from_this();
      asio::async_write(beast::get_lowest_layer(socket_), asio::buffer(server_.options.banner),
                        [self = shared_from_this()](error_code, std::size_t) {});
      return;
    }
    ReadHttp();
  }

  void Break() override {
    beast::get_lowest_layer(socket_).close();
    held_.reset();
  }

 private:
  void ReadHttp() {
    parser_.body_limit(std::uint64_t{64} << 20);
    http::async_read(socket_.next_layer(), buffer_, parser_,
                     Unless([this](std::size_t) { OnHttp(); }));
  }

  void OnHttp() {
    const auto& request = parser_.get();
    const auto text = [](auto view) { return std::string(view.data(), view.size()); };
    const HttpRequest noted{text(request.method_string()), text(request.target()), request.body(),
                            text(request["X-Api-Key"]), text(request[http::field::content_type])};
    const int refusal = server_.NoteHttp(noted);
    if (websocket::is_upgrade(request) && refusal == 0) {
      socket_.read_message_max(std::size_t{64} << 20);
      socket_.async_accept(request, Unless([this] {
                             open_ = true;
                             WriteNext();
                             Read();
                           }));
      return;
    }
    std::function<HttpAnswer(const HttpRequest&)> handler;
    {
      const std::lock_guard lock(server_.mutex);
      handler = server_.http_handler;
    }
    HttpAnswer answer{refusal == 0 ? 404 : refusal, "<html>no</html>"};
    if (handler && refusal == 0) answer = handler(noted);
    http_answer_.result(static_cast<unsigned>(answer.status));
    http_answer_.set(http::field::server, "scripted");
    http_answer_.body() = answer.body;
    http_answer_.prepare_payload();
    http::async_write(socket_.next_layer(), http_answer_,
                      [self = shared_from_this(), this](error_code, std::size_t) {
                        beast::get_lowest_layer(socket_).close();
                      });
  }

  void Read() {
    socket_.async_read(incoming_, Unless([this](std::size_t) {
                         const std::string text = beast::buffers_to_string(incoming_.data());
                         incoming_.consume(incoming_.size());
                         server_.OnText(*this, text);
                         Read();
                       }));
  }

  void Write(const std::string& bytes) override {
    if (open_) socket_.async_write(asio::buffer(bytes), Written());
  }

  ScriptedMoonraker::State& server_;
  std::shared_ptr<Session> held_;  ///< itself, where nothing else keeps the connection open
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  beast::flat_buffer incoming_;
  http::request_parser<http::string_body> parser_;
  http::response<http::string_body> http_answer_;
  bool open_ = false;
};

/// JSON texts that end in byte 0x03.
class UnixSession : public Session {
 public:
  UnixSession(ScriptedMoonraker::State& server, asio::local::stream_protocol::socket socket)
      : server_(server), socket_(std::move(socket)) {}

  void Start() { Read(); }

  void Send(std::string bytes) override { Session::Send(std::move(bytes) + '\x03'); }

  void Break() override { socket_.close(); }

 private:
  void Read() {
    asio::async_read_until(socket_, asio::dynamic_buffer(text_), '\x03',
                           Unless([this](std::size_t size) {
                             const std::string text = text_.substr(0, size - 1);
                             text_.erase(0, size);
                             server_.OnText(*this, text);
                             Read();
                           }));
  }

  void Write(const std::string& bytes) override {
    asio::async_write(socket_, asio::buffer(bytes), Written());
  }

  ScriptedMoonraker::State& server_;
  asio::local::stream_protocol::socket socket_;
  std::string text_;
};

void AcceptTcp(ScriptedMoonraker::State& server) {
  server.tcp_acceptor->async_accept([&server](error_code error, tcp::socket socket) {
    if (error) return;
    socket.set_option(tcp::no_delay(true));
    const auto session = std::make_shared<WebSession>(server, std::move(socket));
    server.Accepted(session);
    session->Start();
    AcceptTcp(server);
  });
}

void AcceptUnix(ScriptedMoonraker::State& server) {
  server.unix_acceptor->async_accept(
      [&server](error_code error, asio::local::stream_protocol::socket socket) {
        if (error) return;
        const auto session = std::make_shared<UnixSession>(server, std::move(socket));
        server.Accepted(session);
        session->Start();
        AcceptUnix(server);
      });
}

}  // namespace

ScriptedMoonraker::ScriptedMoonraker(ServerOptions options)
    : state_(std::make_unique<ScriptedMoonraker::State>(std::move(options))) {
  auto& server = *state_;
  if (server.options.unix_path.empty()) {
    server.tcp_acceptor = std::make_unique<tcp::acceptor>(
        server.io, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
    AcceptTcp(server);
    if (!server.options.certificate_pem.empty()) {
      server.tls = std::make_unique<TlsRelay>(server.io, server.options.certificate_pem,
                                              server.options.key_pem,
                                              server.tcp_acceptor->local_endpoint().port());
    }
  } else {
    server.unix_acceptor = std::make_unique<asio::local::stream_protocol::acceptor>(
        server.io, asio::local::stream_protocol::endpoint(server.options.unix_path));
    AcceptUnix(server);
  }
  server.thread = std::thread([&server] { server.io.run(); });
}

ScriptedMoonraker::~ScriptedMoonraker() {
  state_->io.stop();
  state_->thread.join();
  state_->Each([](Session& session) { session.Break(); });
}

int ScriptedMoonraker::port() const {
  return state_->tls ? state_->tls->port() : state_->tcp_acceptor->local_endpoint().port();
}

void ScriptedMoonraker::Handle(const std::string& method, Handler handler) {
  const std::lock_guard lock(state_->mutex);
  state_->handlers[method] = std::move(handler);
  state_->results.erase(method);
}

void ScriptedMoonraker::Answer(const std::string& method, const Json& result) {
  auto text = std::make_shared<const std::string>(result.dump());
  const std::lock_guard lock(state_->mutex);
  state_->results[method] = std::move(text);
  state_->handlers.erase(method);
}

void ScriptedMoonraker::AnswerError(const std::string& method, int code,
                                    const std::string& message) {
  Handle(method, [code, message](const Json& request) {
    return std::vector{ErrorFor(request, code, message)};
  });
}

void ScriptedMoonraker::HandleHttp(std::function<HttpAnswer(const HttpRequest&)> handler) {
  const std::lock_guard lock(state_->mutex);
  state_->http_handler = std::move(handler);
}

void ScriptedMoonraker::Push(const Json& message) { PushBytes(message.dump()); }

void ScriptedMoonraker::PushBytes(const std::string& bytes) {
  asio::post(state_->io, [state = state_.get(), bytes] {
    state->Each([&bytes](Session& session) { session.Send(bytes); });
  });
}

void ScriptedMoonraker::BreakConnections() {
  asio::post(state_->io,
             [state = state_.get()] { state->Each([](Session& session) { session.Break(); }); });
}

Json ScriptedMoonraker::WaitForRequest(const std::string& method, int n) {
  std::unique_lock lock(state_->mutex);
  Json found;
  state_->changed.wait_for(lock, kPatience, [&] {
    int seen = 0;
    for (const Json& request : state_->requests) {
      seen += request["method"] == method ? 1 : 0;
      if (seen == n && request["method"] == method) {
        found = request;
        return true;
      }
    }
    return false;
  });
  return found;
}

Json ScriptedMoonraker::WaitForAnswer(const Json& id) {
  std::unique_lock lock(state_->mutex);
  Json found;
  state_->changed.wait_for(lock, kPatience, [&] {
    for (const Json& answer : state_->answers) {
      if (answer.value("id", Json("none")) == id) found = answer;
    }
    return !found.is_null();
  });
  return found;
}

int ScriptedMoonraker::CountRequests(const std::string& method) const {
  const std::lock_guard lock(state_->mutex);
  return static_cast<int>(
      std::count_if(state_->requests.begin(), state_->requests.end(),
                    [&method](const Json& request) { return request["method"] == method; }));
}

bool ScriptedMoonraker::WaitForConnections(int count) {
  std::unique_lock lock(state_->mutex);
  return state_->changed.wait_for(lock, kPatience, [&] { return state_->accepted >= count; });
}

HttpRequest ScriptedMoonraker::HttpRequestNumber(int n) const {
  const std::lock_guard lock(state_->mutex);
  const auto index = static_cast<std::size_t>(n - 1);
  return index < state_->http_requests.size() ? state_->http_requests[index] : HttpRequest{};
}

Json ResultFor(const Json& request, const Json& result) {
  return {{"jsonrpc", "2.0"}, {"result", result}, {"id", request.value("id", Json())}};
}

Json ErrorFor(const Json& request, int code, const std::string& message) {
  return {{"jsonrpc", "2.0"},
          {"error", {{"code", code}, {"message", message}}},
          {"id", request.value("id", Json())}};
}

Json GcodeResponse(const std::string& line) {
  return {{"jsonrpc", "2.0"}, {"method", "notify_gcode_response"}, {"params", {line}}};
}

Json SmallPrinterStatus(const std::string& klippy_state) {
  return {{"webhooks", {{"state", klippy_state}, {"state_message", "Printer is " + klippy_state}}},
          {"toolhead",
           {{"homed_axes", "xyz"},
            {"position", {10.0, 20.0, 5.0, 0.0}},
            {"axis_minimum", {-2.0, -2.0, -5.0, 0.0}},
            {"axis_maximum", {235.0, 235.0, 250.0, 0.0}},
            {"max_velocity", 300.0},
            {"max_accel", 10000.0},
            {"minimum_cruise_ratio", 0.5},
            {"square_corner_velocity", 5.0},
            {"estimated_print_time", 87.5},
            {"extruder", "extruder"}}},
          {"motion_report", {{"live_position", {10.0, 20.0, 5.0, 0.0}}, {"live_velocity", 0.0}}},
          {"extruder",
           {{"temperature", 25.0},
            {"target", 0.0},
            {"can_extrude", false},
            {"pressure_advance", 0.04},
            {"smooth_time", 0.03}}},
          {"heater_bed", {{"temperature", 24.0}, {"target", 60.0}}},
          {"output_pin LASER", {{"value", 0.0}}},
          {"gcode_move",
           {{"absolute_coordinates", true},
            {"absolute_extrude", false},
            {"speed", 1500.0},
            {"speed_factor", 1.0},
            {"extrude_factor", 0.95},
            {"homing_origin", {0.0, 0.0, -0.05, 0.0}},
            {"gcode_position", {10.0, 20.0, 5.05, 0.0}}}},
          {"print_stats", {{"state", "standby"}, {"filename", ""}, {"message", ""}}},
          {"virtual_sdcard", {{"progress", 0.0}, {"is_active", false}}},
          {"idle_timeout", {{"state", "Ready"}}},
          {"pause_resume", {{"is_paused", false}}}};
}

Json StatusUpdate(const Json& objects, double eventtime_s) {
  return {{"jsonrpc", "2.0"},
          {"method", "notify_status_update"},
          {"params", Json::array({objects, eventtime_s})}};
}

Json Notification(const std::string& method) { return {{"jsonrpc", "2.0"}, {"method", method}}; }

void AnswerLikeMoonraker(ScriptedMoonraker& server, const std::string& klippy_state) {
  server.Answer("server.connection.identify", {{"connection_id", 1730367696}});
  server.Answer("server.info", {{"klippy_connected", klippy_state != "disconnected"},
                                {"klippy_state", klippy_state},
                                {"api_version", {1, 5, 0}}});
  server.Answer("printer.info",
                {{"state", klippy_state}, {"state_message", "Printer is " + klippy_state}});
  Json objects = Json::array({"gcode_macro LASER_ON"});
  const Json status = SmallPrinterStatus(klippy_state);
  for (const auto& [name, fields] : status.items()) objects.push_back(name);
  server.Answer("printer.objects.list", {{"objects", objects}});
  for (const char* method : {"printer.objects.subscribe", "printer.objects.query"}) {
    server.Answer(method, {{"eventtime", 3045.4}, {"status", status}});
  }
  server.Answer("printer.gcode.script", "ok");
  server.Answer("connection.register_remote_method", "ok");
  server.Answer("printer.motion_report.dump_trapq", {{"header", {"time", "duration"}}});
}

}  // namespace trammel::test

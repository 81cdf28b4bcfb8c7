#include "support/scripted_moonraker.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <condition_variable>
#include <list>
#include <map>
#include <mutex>
#include <thread>

#include "support/scripted_session.h"
#include "support/tls_relay.h"

namespace trammel::test {

using asio::ip::tcp;
using Json = nlohmann::json;

namespace {

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

  int NoteHttp(const HttpRequest& request) {
    const std::lock_guard lock(mutex);
    http_requests.push_back(request);
    return options.upgrade_status;
  }

  /// Answers one text of a client.
  void OnText(Session& session, const std::string& text) {
    const Json request = Json::parse(text, nullptr, false);
    if (!request.is_object()) {
      return;
    }
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
      if (known != results.end()) {
        result = known->second;
      }
      const auto found = handlers.find(method);
      if (found != handlers.end()) {
        handler = found->second;
      }
    }
    if (result) {
      const std::string id = request.value("id", Json()).dump();
      return session.Send(R"({"id":)" + id + R"(,"jsonrpc":"2.0","result":)" + *result + "}");
    }
    const std::vector<Json> replies =
        handler ? handler(request)
                : std::vector<Json>{ErrorFor(request, -32601, "Method not found")};
    for (const Json& answer : replies) {
      session.Send(answer.dump());
    }
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
  /// Of methods without a handler, as texts: a large one is written once.
  std::map<std::string, std::shared_ptr<const std::string>> results;
  std::function<HttpAnswer(const HttpRequest&)> http_handler;
  std::vector<Json> requests;
  std::vector<Json> answers;  // of the client
  std::vector<HttpRequest> http_requests;
  std::list<std::weak_ptr<Session>> sessions;
  int accepted = 0;
};

namespace {

template <class ServerState>
void AcceptTcp(ServerState& server) {
  server.tcp_acceptor->async_accept([&server](error_code error, tcp::socket socket) {
    if (error) {
      return;
    }
    socket.set_option(tcp::no_delay(true));
    const auto session = std::make_shared<WebSession<ServerState>>(server, std::move(socket));
    server.Accepted(session);
    session->Start();
    AcceptTcp(server);
  });
}

template <class ServerState>
void AcceptUnix(ServerState& server) {
  server.unix_acceptor->async_accept(
      [&server](error_code error, asio::local::stream_protocol::socket socket) {
        if (error) {
          return;
        }
        const auto session = std::make_shared<UnixSession<ServerState>>(server, std::move(socket));
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
  for (const auto& weak : state_->sessions) {
    if (const auto session = weak.lock()) {
      session->Break();
    }
  }
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
    for (const auto& weak : state->sessions) {
      if (const auto session = weak.lock()) {
        session->Send(bytes);
      }
    }
  });
}

void ScriptedMoonraker::BreakConnections() {
  asio::post(state_->io, [state = state_.get()] {
    for (const auto& weak : state->sessions) {
      if (const auto session = weak.lock()) {
        session->Break();
      }
    }
  });
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

}  // namespace trammel::test

#include "sim/moonraker/test_client.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <stdexcept>

namespace trammel::sim {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
constexpr auto kLongest = std::chrono::seconds(10);

net::ip::tcp::endpoint Loopback(std::uint16_t port) {
  return {net::ip::address_v4::loopback(), port};
}

}  // namespace

struct TestClient::Wire {
  net::io_context context;
  websocket::stream<beast::tcp_stream> web{context};
  beast::flat_buffer buffer;
};

TestClient::TestClient(std::uint16_t port, const std::string& target, const std::string& api_key)
    : wire_(std::make_unique<Wire>()) {
  beast::get_lowest_layer(wire_->web).socket().connect(Loopback(port));
  wire_->web.set_option(websocket::stream_base::decorator([api_key](auto& request) {
    if (!api_key.empty()) request.set("X-Api-Key", api_key);
  }));
  wire_->web.handshake("127.0.0.1", target);
}

TestClient::~TestClient() = default;

void TestClient::SendText(const std::string& text) { wire_->web.write(net::buffer(text)); }

int TestClient::Send(const std::string& method, const Json& params) {
  Json request = {{"jsonrpc", "2.0"}, {"method", method}, {"id", next_id_}};
  if (!params.is_null()) request["params"] = params;
  SendText(request.dump());
  return next_id_++;
}

std::optional<TestClient::Json> TestClient::Next() {
  bool done = false;
  beast::error_code failure;
  wire_->web.async_read(wire_->buffer, [&](const beast::error_code& error, std::size_t) {
    done = true;
    failure = error;
  });
  wire_->context.restart();
  wire_->context.run_for(kLongest);
  if (!done) throw std::runtime_error("no message of the server within 10 s");
  if (failure) return std::nullopt;
  const std::string text = beast::buffers_to_string(wire_->buffer.data());
  wire_->buffer.clear();
  return Json::parse(text);
}

TestClient::Json TestClient::AnswerTo(int id) {
  while (std::optional<Json> message = Next()) {
    if (message->value("id", Json()) == id) return *message;
    passed.push_back(*message);
  }
  throw std::runtime_error("the server closed before it answered");
}

TestClient::Json TestClient::Call(const std::string& method, const Json& params) {
  return AnswerTo(Send(method, params));
}

TestClient::Json TestClient::WaitFor(const std::string& method) {
  const auto limit = std::chrono::steady_clock::now() + kLongest;
  while (std::optional<Json> message = Next()) {
    if (message->value("method", "") == method) return *message;
    if (std::chrono::steady_clock::now() > limit) break;
    passed.push_back(*message);
  }
  throw std::runtime_error("the server did not send " + method);
}

TestResponse TestHttp(std::uint16_t port, const std::string& method, const std::string& target,
                      const std::string& body,
                      const std::vector<std::pair<std::string, std::string>>& headers) {
  net::io_context context;
  beast::tcp_stream stream(context);
  stream.socket().connect(Loopback(port));
  http::request<http::string_body> request;
  request.version(11);
  request.method_string(method);
  request.target(target);
  request.set(http::field::host, "127.0.0.1");
  for (const auto& [name, value] : headers) request.set(name, value);
  request.body() = body;
  request.prepare_payload();
  http::write(stream, request);
  beast::flat_buffer buffer;
  http::response<http::string_body> response;
  stream.expires_after(kLongest);
  beast::error_code failure = http::error::partial_message;
  http::async_read(stream, buffer, response,
                   [&](const beast::error_code& error, std::size_t) { failure = error; });
  context.run();
  if (failure) throw std::runtime_error("no answer to " + target + ": " + failure.message());
  return {static_cast<int>(response.result_int()), response.body()};
}

}  // namespace trammel::sim

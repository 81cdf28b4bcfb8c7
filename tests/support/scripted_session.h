// The connections of scripted_moonraker.cc, which alone includes this.
#pragma once

#include <array>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "support/scripted_moonraker.h"

namespace trammel::test {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;

/// An accepted connection; everything on the server's thread.
class Session {
 public:
  virtual ~Session() = default;
  virtual void Send(std::string bytes) = 0;
  virtual void Break() = 0;
};

/// HTTP and, after an upgrade, WebSocket. ServerState is ScriptedMoonraker::State.
template <class ServerState>
class WebSession : public Session, public std::enable_shared_from_this<WebSession<ServerState>> {
 public:
  WebSession(ServerState& server, asio::ip::tcp::socket socket)
      : server_(server), socket_(std::move(socket)) {}

  void Start() {
    if (server_.options.silent) {
      held_ = this->shared_from_this();
      return;
    }
    if (!server_.options.banner.empty()) {
      held_ = this->shared_from_this();
      asio::async_write(beast::get_lowest_layer(socket_), asio::buffer(server_.options.banner),
                        [self = this->shared_from_this()](error_code, std::size_t) {});
      return;
    }
    ReadHttp();
  }

  void Send(std::string bytes) override {
    queue_.push_back(std::move(bytes));
    if (queue_.size() == 1) {
      WriteNext();
    }
  }

  void Break() override {
    beast::get_lowest_layer(socket_).close();
    held_.reset();
  }

 private:
  void ReadHttp() {
    parser_.body_limit(std::uint64_t{64} << 20);
    http::async_read(socket_.next_layer(), buffer_, parser_,
                     [self = this->shared_from_this()](error_code error, std::size_t) {
                       if (!error) {
                         self->OnHttp();
                       }
                     });
  }

  void OnHttp() {
    const auto& request = parser_.get();
    const auto text = [](auto view) { return std::string(view.data(), view.size()); };
    const HttpRequest noted{text(request.method_string()), text(request.target()), request.body(),
                            text(request["X-Api-Key"]), text(request[http::field::content_type])};
    const int refusal = server_.NoteHttp(noted);
    if (websocket::is_upgrade(request) && refusal == 0) {
      socket_.read_message_max(std::size_t{64} << 20);
      socket_.async_accept(request, [self = this->shared_from_this()](error_code error) {
        if (!error) {
          self->open_ = true;
          self->WriteNext();
          self->Read();
        }
      });
      return;
    }
    std::function<HttpAnswer(const HttpRequest&)> handler;
    {
      const std::lock_guard lock(server_.mutex);
      handler = server_.http_handler;
    }
    HttpAnswer answer{refusal == 0 ? 404 : refusal, "<html>no</html>"};
    if (handler && refusal == 0) {
      answer = handler(noted);
    }
    http_answer_.result(static_cast<unsigned>(answer.status));
    http_answer_.set(http::field::server, "scripted");
    http_answer_.body() = answer.body;
    http_answer_.prepare_payload();
    http::async_write(socket_.next_layer(), http_answer_,
                      [self = this->shared_from_this()](error_code, std::size_t) {
                        beast::get_lowest_layer(self->socket_).close();
                      });
  }

  void Read() {
    socket_.async_read(incoming_, [self = this->shared_from_this()](error_code error, std::size_t) {
      if (error) {
        return;
      }
      const std::string text = beast::buffers_to_string(self->incoming_.data());
      self->incoming_.consume(self->incoming_.size());
      self->server_.OnText(*self, text);
      self->Read();
    });
  }

  void WriteNext() {
    if (!open_ || queue_.empty()) {
      return;
    }
    socket_.async_write(asio::buffer(queue_.front()),
                        [self = this->shared_from_this()](error_code error, std::size_t) {
                          if (!error) {
                            self->queue_.pop_front();
                            self->WriteNext();
                          }
                        });
  }

  ServerState& server_;
  std::shared_ptr<Session> held_;  ///< itself, where nothing else keeps the connection open
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  beast::flat_buffer incoming_;
  http::request_parser<http::string_body> parser_;
  http::response<http::string_body> http_answer_;
  std::deque<std::string> queue_;
  bool open_ = false;
};

/// JSON texts that end in byte 0x03.
template <class ServerState>
class UnixSession : public Session, public std::enable_shared_from_this<UnixSession<ServerState>> {
 public:
  UnixSession(ServerState& server, asio::local::stream_protocol::socket socket)
      : server_(server), socket_(std::move(socket)) {}

  void Start() { Read(); }

  void Send(std::string bytes) override {
    queue_.push_back(std::move(bytes) + '\x03');
    if (queue_.size() == 1) {
      WriteNext();
    }
  }

  void Break() override { socket_.close(); }

 private:
  void Read() {
    socket_.async_read_some(asio::buffer(chunk_),
                            [self = this->shared_from_this()](error_code error, std::size_t bytes) {
                              if (error) {
                                return;
                              }
                              self->text_.append(self->chunk_.data(), bytes);
                              for (std::size_t end = self->text_.find('\x03');
                                   end != std::string::npos; end = self->text_.find('\x03')) {
                                const std::string text = self->text_.substr(0, end);
                                self->text_.erase(0, end + 1);
                                self->server_.OnText(*self, text);
                              }
                              self->Read();
                            });
  }

  void WriteNext() {
    asio::async_write(socket_, asio::buffer(queue_.front()),
                      [self = this->shared_from_this()](error_code error, std::size_t) {
                        if (!error) {
                          self->queue_.pop_front();
                          if (!self->queue_.empty()) {
                            self->WriteNext();
                          }
                        }
                      });
  }

  ServerState& server_;
  asio::local::stream_protocol::socket socket_;
  std::array<char, 4096> chunk_{};
  std::string text_;
  std::deque<std::string> queue_;
};

}  // namespace trammel::test

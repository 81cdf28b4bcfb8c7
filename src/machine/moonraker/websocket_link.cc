#include <fmt/format.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <deque>
#include <optional>

#include "machine/moonraker/moonraker_link.h"
#include "machine/moonraker/net_failure.h"
#include "machine/moonraker/net_stream.h"
#include "machine/moonraker/tls_stream.h"

namespace trammel::machine {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

// A peer that has been silent for this long, pings included, is gone (cable pulled, computer off).
constexpr std::chrono::seconds kSilence{15};

std::chrono::steady_clock::duration Seconds(double time_s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(time_s));
}

class WebSocketLink : public MoonrakerLink, public std::enable_shared_from_this<WebSocketLink> {
  /// A completion handler that reports an error of its step, and goes on otherwise. Stands before
  /// its callers, which need its type.
  template <class Then>
  auto Step(NetStep step, Then then) {
    return [self = shared_from_this(), step, then](error_code error, const auto& result) {
      if (self->closed_) {
        return;
      }
      if (error) {
        self->Down(NetFailure(step, error, self->address_, self->options_.connect_time_limit_s));
        return;
      }
      then(result);
    };
  }

 public:
  /// @param tls  null: plain
  WebSocketLink(MoonrakerAddress address, MoonrakerOptions options, LinkEvents events,
                asio::io_context& io, asio::ssl::context* tls)
      : address_(std::move(address)),
        options_(std::move(options)),
        events_(std::move(events)),
        resolver_(io),
        socket_(io, tls) {}

  void Open() override {
    resolver_.async_resolve(
        address_.host, address_.port,
        Step(NetStep::kLookUp, [this](const tcp::resolver::results_type& found) {
          beast::get_lowest_layer(socket_).expires_after(Seconds(options_.connect_time_limit_s));
          beast::get_lowest_layer(socket_).async_connect(
              found, Step(NetStep::kConnect, [this](const tcp::endpoint&) {
                error_code ignored;
                beast::get_lowest_layer(socket_).socket().set_option(tcp::no_delay(true), ignored);
                Secure();
              }));
        }));
  }

  void Write(std::string message) override {
    queue_.push_back(std::move(message));
    if (queue_.size() == 1) {
      WriteNext();
    }
  }

  void Finish() override {
    socket_.async_close(websocket::close_code::normal, [self = shared_from_this()](error_code) {
      self->Down(fmt::format("closed the connection to {}", self->address_.WebSocketUrl()));
    });
  }

  void Close() override {
    closed_ = true;
    resolver_.cancel();
    beast::get_lowest_layer(socket_).close();
  }

 private:
  void Down(std::string message, ErrorKind kind = ErrorKind::kMachine) {
    if (!closed_) {
      Close();
      events_.on_down({kind, std::move(message)});
    }
  }

  void Secure() {
    SSL* const ssl = socket_.next_layer().tls();
    if (ssl == nullptr) return Upgrade();
    if (const Result<void> expected = ExpectHost(ssl, address_, options_); !expected) {
      Down(expected.error().message, expected.error().kind);
      return;
    }
    socket_.next_layer().AsyncHandshake([self = shared_from_this(), ssl](error_code error) {
      if (self->closed_) {
        return;
      }
      if (error) {
        self->Down(TlsFailure(ssl, self->address_, error.message()));
        return;
      }
      self->Upgrade();
    });
  }

  void Upgrade() {
    beast::get_lowest_layer(socket_).expires_never();
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = Seconds(options_.connect_time_limit_s);
    timeout.idle_timeout = kSilence;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.set_option(websocket::stream_base::decorator([this](websocket::request_type& request) {
      request.set(beast::http::field::user_agent, options_.client_name);
      if (!options_.api_key.empty()) {
        request.set("X-Api-Key", options_.api_key);
      }
    }));
    socket_.read_message_max(options_.max_message_bytes);
    std::string target = address_.path_prefix + address_.endpoint;
    if (!options_.one_shot_token.empty()) {
      target += "?token=" + options_.one_shot_token;
    }
    socket_.async_handshake(answer_, address_.Authority(), target,
                            [self = shared_from_this()](error_code error) {
                              if (self->closed_) {
                                return;
                              }
                              if (error) {
                                self->Down(self->UpgradeFailure(error));
                                return;
                              }
                              self->events_.on_open();
                              self->Read();
                            });
  }

  std::string UpgradeFailure(error_code error) const {
    if (error == websocket::error::upgrade_declined) {
      const auto server = answer_[beast::http::field::server];
      const bool had_key = !options_.api_key.empty() || !options_.one_shot_token.empty();
      return HttpRefusal(static_cast<int>(answer_.result_int()), {server.data(), server.size()},
                         address_, had_key);
    }
    return NetFailure(NetStep::kTalk, error, address_, options_.connect_time_limit_s);
  }

  void Read() {
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (self->closed_) {
        return;
      }
      if (error) {
        self->Down(self->Broken(error));
        return;
      }
      const auto data = self->buffer_.cdata();
      self->events_.on_message({static_cast<const char*>(data.data()), data.size()});
      if (!self->closed_) {
        self->buffer_.consume(self->buffer_.size());
        self->Read();
      }
    });
  }

  std::string Broken(error_code error) const {
    if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow) {
      return fmt::format(
          "{} sent a message of more than {} bytes, the most that is taken; that is no answer of "
          "a Moonraker",
          address_.WebSocketUrl(), options_.max_message_bytes);
    }
    if (error == beast::error::timeout) {
      return fmt::format(
          "lost the connection to {}: nothing came for {} s; check the network and that the "
          "printer's computer is on",
          address_.WebSocketUrl(), kSilence.count());
    }
    if (error == websocket::error::closed) {
      const auto& reason = socket_.reason();
      return fmt::format("{} closed the connection (code {}{}{}); see moonraker.log there",
                         address_.WebSocketUrl(), static_cast<unsigned>(reason.code),
                         reason.reason.empty() ? "" : ": ", reason.reason.c_str());
    }
    return fmt::format("lost the connection to {}: {}; check the network and that Moonraker runs",
                       address_.WebSocketUrl(), error.message());
  }

  void WriteNext() {
    socket_.text(true);
    socket_.async_write(asio::buffer(queue_.front()),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          if (self->closed_) {
                            return;
                          }
                          if (error) {
                            self->Down(self->Broken(error));
                            return;
                          }
                          self->events_.on_written(self->queue_.front().size());
                          self->queue_.pop_front();
                          if (!self->queue_.empty()) {
                            self->WriteNext();
                          }
                        });
  }

  const MoonrakerAddress address_;
  const MoonrakerOptions options_;
  const LinkEvents events_;
  bool closed_ = false;
  tcp::resolver resolver_;
  websocket::stream<NetStream> socket_;
  websocket::response_type answer_;
  beast::flat_buffer buffer_;
  std::deque<std::string> queue_;
};

/// A link that cannot be: says why as soon as it is opened.
class RefusedLink : public MoonrakerLink {
 public:
  RefusedLink(asio::io_context& io, LinkEvents events, Error error)
      : io_(io), events_(std::move(events)), error_(std::move(error)) {}

  void Open() override {
    asio::post(io_, [on_down = events_.on_down, error = error_] { on_down(error); });
  }
  void Write(std::string) override {}
  void Finish() override {}
  void Close() override {}

 private:
  asio::io_context& io_;
  const LinkEvents events_;
  const Error error_;
};

}  // namespace

std::shared_ptr<MoonrakerLink> MakeWebSocketLink(asio::io_context& io,
                                                 const MoonrakerAddress& address,
                                                 const MoonrakerOptions& options,
                                                 LinkEvents events) {
  if (address.transport != Transport::kTls) {
    return std::make_shared<WebSocketLink>(address, options, std::move(events), io, nullptr);
  }
  Result<asio::ssl::context> context = MakeTlsContext(options);
  if (!context) {
    return std::make_shared<RefusedLink>(io, std::move(events), context.error());
  }
  return std::make_shared<WebSocketLink>(address, options, std::move(events), io, &*context);
}

}  // namespace trammel::machine

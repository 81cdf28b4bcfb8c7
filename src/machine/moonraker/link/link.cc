#include "machine/moonraker/link/link.h"

#include <fmt/format.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <deque>
#include <optional>
#include <utility>

#include "machine/net/net_stream.h"

namespace trammel::machine {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

/// Base of both kinds of link: queue of messages, and a single report of the end.
class QueuedLink : public MoonrakerLink, public std::enable_shared_from_this<QueuedLink> {
 protected:
  QueuedLink(MoonrakerAddress address, MoonrakerOptions options, LinkEvents events)
      : address_(std::move(address)), options_(std::move(options)), events_(std::move(events)) {}

 public:
  void Write(std::string message) override {
    queue_.push_back(std::move(message));
    if (queue_.size() == 1) WriteFirst();
  }

  void Close() override {
    closed_ = true;
    CloseSocket();
  }

 protected:
  virtual void CloseSocket() = 0;
  /// Writes queue_.front(), and calls Written().
  virtual void WriteFirst() = 0;

  void Written() {
    events_.on_written(queue_.front().size());
    queue_.pop_front();
    if (!queue_.empty()) WriteFirst();
  }

  void Down(Error error) {
    if (closed_) return;
    Close();
    events_.on_down(std::move(error));
  }
  void Down(std::string message) { Down(Error{ErrorKind::kMachine, std::move(message)}); }

  /// Returns a completion handler: an error ends the link with the reason from `why`.
  template <class Why, class Then>
  auto Step(Why why, Then then) {
    return [self = shared_from_this(), this, why, then](error_code error, auto... result) {
      if (closed_) return;
      if (error) return Down(why(error));
      then(result...);
    };
  }

  const MoonrakerAddress address_;
  const MoonrakerOptions options_;
  const LinkEvents events_;
  bool closed_ = false;
  std::deque<std::string> queue_;
};

constexpr char kEndOfMessage = '\x03';

class UnixLink : public QueuedLink {
 public:
  UnixLink(asio::io_context& io, const MoonrakerAddress& address, const MoonrakerOptions& options,
           LinkEvents events)
      : QueuedLink(address, options, std::move(events)), socket_(io) {}

  void Open() override {
    // Connecting to a Unix socket succeeds or fails at once.
    socket_.async_connect(asio::local::stream_protocol::endpoint(address_.unix_path),
                          Step([this](error_code error) { return CannotConnect(error); },
                               [this] {
                                 events_.on_open();
                                 Read();
                               }));
  }

  void Finish() override {
    error_code ignored;
    socket_.shutdown(asio::local::stream_protocol::socket::shutdown_send, ignored);
  }

 private:
  void CloseSocket() override {
    error_code ignored;
    socket_.close(ignored);
  }

  [[nodiscard]] std::string CannotConnect(error_code error) const {
    std::string remedy = "check that Moonraker runs and that this is its moonraker.sock";
    if (error == asio::error::access_denied) {
      remedy = "run trammel as the user that Moonraker runs as, or join its group";
    } else if (error == asio::error::connection_refused) {
      remedy = "the socket is left over from a Moonraker that no longer runs: start it";
    }
    return fmt::format("cannot connect to the Unix socket {}: {}; {}", address_.unix_path,
                       error.message(), remedy);
  }

  void Read() {
    socket_.async_read_some(asio::buffer(chunk_),
                            Step(
                                [this](error_code error) {
                                  return fmt::format("Moonraker closed its Unix socket {}: {}",
                                                     address_.unix_path, error.message());
                                },
                                [this](std::size_t bytes) {
                                  if (Take({chunk_.data(), bytes})) Read();
                                }));
  }

  /// Passes on the complete messages; false if the link is down afterwards.
  bool Take(std::string_view bytes) {
    while (!bytes.empty()) {
      const std::size_t end = bytes.find(kEndOfMessage);
      incoming_.append(bytes.substr(0, end));
      if (incoming_.size() > kMaxMessageBytes) {
        Down(fmt::format(
            "{} sent a message of more than {} bytes; is that moonraker.sock and not another "
            "program's socket?",
            address_.unix_path, kMaxMessageBytes));
        return false;
      }
      if (end == std::string_view::npos) return true;
      bytes.remove_prefix(end + 1);
      const std::string message = std::exchange(incoming_, {});
      events_.on_message(message);
      if (closed_) return false;
    }
    return true;
  }

  void WriteFirst() override {
    const std::array<asio::const_buffer, 2> all = {asio::buffer(queue_.front()),
                                                   asio::buffer(&kEndOfMessage, 1)};
    asio::async_write(socket_, all,
                      Step(
                          [this](error_code error) {
                            return fmt::format("cannot write to the Unix socket {}: {}",
                                               address_.unix_path, error.message());
                          },
                          [this](std::size_t) { Written(); }));
  }

  asio::local::stream_protocol::socket socket_;
  std::array<char, 65536> chunk_{};
  std::string incoming_;
};

// Timeout of a peer without data, pings included (cable pulled, computer off).
constexpr std::chrono::seconds kSilence{15};

class WebSocketLink : public QueuedLink {
 public:
  WebSocketLink(asio::io_context& io, const MoonrakerAddress& address,
                const MoonrakerOptions& options, LinkEvents events)
      : QueuedLink(address, options, std::move(events)),
        socket_(io, EndpointOf(address, options)) {}

  void Open() override {
    socket_.next_layer().AsyncConnect(
        [self = shared_from_this(), this](std::optional<Error> error) {
          if (closed_) return;
          error ? Down(*std::move(error)) : Upgrade();
        });
  }

  void Finish() override {
    socket_.async_close(websocket::close_code::normal,
                        [self = shared_from_this(), this](error_code) {
                          Down(fmt::format("closed the connection to {}", address_.WebSocketUrl()));
                        });
  }

 private:
  void CloseSocket() override { socket_.next_layer().Close(); }

  void Upgrade() {
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(options_.connect_time_limit_s));
    timeout.idle_timeout = kSilence;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.set_option(websocket::stream_base::decorator([this](websocket::request_type& request) {
      request.set(beast::http::field::user_agent, options_.client_name);
      if (!options_.api_key.empty()) request.set("X-Api-Key", options_.api_key);
    }));
    socket_.read_message_max(kMaxMessageBytes);
    socket_.text(true);
    socket_.async_handshake(answer_, address_.Authority(), address_.path_prefix + address_.endpoint,
                            Step([this](error_code error) { return UpgradeFailure(error); },
                                 [this] {
                                   events_.on_open();
                                   Read();
                                 }));
  }

  std::string UpgradeFailure(error_code error) const {
    if (error == websocket::error::upgrade_declined) {
      const auto server = answer_[beast::http::field::server];
      return HttpRefusal(static_cast<int>(answer_.result_int()), {server.data(), server.size()},
                         address_, !options_.api_key.empty());
    }
    if (error == beast::error::timeout) {
      return fmt::format(
          "{} took the connection but said nothing within {} s; is that port Moonraker's?",
          address_.Authority(), options_.connect_time_limit_s);
    }
    const bool not_http =
        error.category() == make_error_code(beast::http::error::bad_version).category();
    return fmt::format("{} is not a Moonraker: {} ({}); check the port (Moonraker's own is 7125)",
                       address_.Authority(),
                       not_http ? "what it says is not HTTP" : "it broke off the conversation",
                       error.message());
  }

  void Read() {
    socket_.async_read(
        buffer_, Step([this](error_code error) { return Broken(error); },
                      [this](std::size_t) {
                        const auto data = buffer_.cdata();
                        events_.on_message({static_cast<const char*>(data.data()), data.size()});
                        if (closed_) return;
                        buffer_.consume(buffer_.size());
                        Read();
                      }));
  }

  std::string Broken(error_code error) const {
    if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow) {
      return fmt::format(
          "{} sent a message of more than {} bytes, the most that is taken; that is no answer of "
          "a Moonraker",
          address_.WebSocketUrl(), kMaxMessageBytes);
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

  void WriteFirst() override {
    socket_.async_write(asio::buffer(queue_.front()),
                        Step([this](error_code error) { return Broken(error); },
                             [this](std::size_t) { Written(); }));
  }

  websocket::stream<NetStream> socket_;
  websocket::response_type answer_;
  beast::flat_buffer buffer_;
};

}  // namespace

std::shared_ptr<MoonrakerLink> MakeLink(asio::io_context& io, const MoonrakerAddress& address,
                                        const MoonrakerOptions& options, LinkEvents events) {
  if (address.transport == Transport::kUnix) {
    return std::make_shared<UnixLink>(io, address, options, std::move(events));
  }
  return std::make_shared<WebSocketLink>(io, address, options, std::move(events));
}

}  // namespace trammel::machine

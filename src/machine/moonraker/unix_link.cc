#include <fmt/format.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/write.hpp>
#include <deque>

#include "machine/moonraker/moonraker_link.h"

namespace trammel::machine {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr char kEndOfMessage = '\x03';

class UnixLink : public MoonrakerLink, public std::enable_shared_from_this<UnixLink> {
 public:
  UnixLink(asio::io_context& io, const MoonrakerAddress& address, const MoonrakerOptions& options,
           LinkEvents events)
      : socket_(io),
        path_(address.unix_path),
        max_message_bytes_(options.max_message_bytes),
        events_(std::move(events)) {}

  void Open() override {
    // Connecting to a Unix socket succeeds or fails at once.
    socket_.async_connect(asio::local::stream_protocol::endpoint(path_),
                          [self = shared_from_this()](error_code error) {
                            if (self->closed_) {
                              return;
                            }
                            if (error) {
                              self->Down(self->CannotConnect(error));
                              return;
                            }
                            self->events_.on_open();
                            self->Read();
                          });
  }

  void Write(std::string message) override {
    message.push_back(kEndOfMessage);
    queue_.push_back(std::move(message));
    if (queue_.size() == 1) {
      WriteNext();
    }
  }

  void Finish() override {
    error_code ignored;
    socket_.shutdown(asio::local::stream_protocol::socket::shutdown_send, ignored);
  }

  void Close() override {
    closed_ = true;
    error_code ignored;
    socket_.close(ignored);
  }

 private:
  [[nodiscard]] std::string CannotConnect(error_code error) const {
    std::string remedy = "check that Moonraker runs and that this is its moonraker.sock";
    if (error == asio::error::access_denied) {
      remedy = "run trammel as the user that Moonraker runs as, or join its group";
    } else if (error == asio::error::connection_refused) {
      remedy = "the socket is left over from a Moonraker that no longer runs: start it";
    }
    return fmt::format("cannot connect to the Unix socket {}: {}; {}", path_, error.message(),
                       remedy);
  }

  void Down(std::string message) {
    if (!closed_) {
      Close();
      events_.on_down({ErrorKind::kMachine, std::move(message)});
    }
  }

  void Read() {
    socket_.async_read_some(asio::buffer(chunk_),
                            [self = shared_from_this()](error_code error, std::size_t bytes) {
                              if (self->closed_) {
                                return;
                              }
                              if (error) {
                                self->Down(fmt::format("Moonraker closed its Unix socket {}: {}",
                                                       self->path_, error.message()));
                                return;
                              }
                              if (self->Take({self->chunk_.data(), bytes})) {
                                self->Read();
                              }
                            });
  }

  /// Hands on the messages that are whole now; false where the link is down after that.
  bool Take(std::string_view bytes) {
    while (!bytes.empty()) {
      const std::size_t end = bytes.find(kEndOfMessage);
      incoming_.append(bytes.substr(0, end));
      if (incoming_.size() > max_message_bytes_) {
        Down(fmt::format(
            "{} sent a message of more than {} bytes; is that moonraker.sock and not another "
            "program's socket?",
            path_, max_message_bytes_));
        return false;
      }
      if (end == std::string_view::npos) {
        return true;
      }
      bytes.remove_prefix(end + 1);
      const std::string message = std::exchange(incoming_, {});
      events_.on_message(message);
      if (closed_) {
        return false;
      }
    }
    return true;
  }

  void WriteNext() {
    asio::async_write(socket_, asio::buffer(queue_.front()),
                      [self = shared_from_this()](error_code error, std::size_t) {
                        if (self->closed_) {
                          return;
                        }
                        if (error) {
                          self->Down(fmt::format("cannot write to the Unix socket {}: {}",
                                                 self->path_, error.message()));
                          return;
                        }
                        self->events_.on_written(self->queue_.front().size() - 1);
                        self->queue_.pop_front();
                        if (!self->queue_.empty()) {
                          self->WriteNext();
                        }
                      });
  }

  asio::local::stream_protocol::socket socket_;
  const std::string path_;
  const std::size_t max_message_bytes_;
  LinkEvents events_;
  bool closed_ = false;
  std::array<char, 65536> chunk_{};
  std::string incoming_;
  std::deque<std::string> queue_;
};

}  // namespace

std::shared_ptr<MoonrakerLink> MakeUnixLink(asio::io_context& io, const MoonrakerAddress& address,
                                            const MoonrakerOptions& options, LinkEvents events) {
  return std::make_shared<UnixLink>(io, address, options, std::move(events));
}

}  // namespace trammel::machine

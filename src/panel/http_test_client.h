// Clients of a panel in tests: plain HTTP, byte for byte, and a WebSocket.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <memory>
#include <string>

namespace trammel::panel {

namespace net = boost::asio;
namespace websocket = boost::beast::websocket;

class Connection {
 public:
  explicit Connection(std::uint16_t port) {
    socket_.connect({net::ip::make_address("127.0.0.1"), port});
  }

  Connection& Send(const std::string& bytes) {
    boost::system::error_code gone;
    net::write(socket_, net::buffer(bytes), gone);
    return *this;
  }

  // Reads until the server closes the connection.
  std::string ReadAll() {
    std::string text;
    boost::system::error_code end;
    net::read(socket_, net::dynamic_buffer(text), end);
    return text;
  }

  // Reads a head and a body of the stated length.
  std::string ReadOne() {
    std::string text;
    std::size_t wanted = std::string::npos;
    boost::system::error_code end;
    while (!end && text.size() < wanted) {
      char c = 0;
      net::read(socket_, net::buffer(&c, 1), end);
      text += c;
      if (wanted == std::string::npos && text.ends_with("\r\n\r\n")) {
        const std::size_t length = text.find("Content-Length: ");
        wanted =
            text.size() + (length == std::string::npos ? 0 : std::stoul(text.substr(length + 16)));
      }
    }
    return text;
  }

 private:
  net::io_context io_;
  net::ip::tcp::socket socket_{io_};
};

class Socket {
 public:
  /// Opens a WebSocket; null where it is refused. @param origin  empty: none
  static std::unique_ptr<Socket> Open(std::uint16_t port, const std::string& origin = {}) {
    auto socket = std::make_unique<Socket>();
    socket->stream_.next_layer().connect({net::ip::make_address("127.0.0.1"), port});
    socket->stream_.set_option(
        websocket::stream_base::decorator([&origin](websocket::request_type& request) {
          if (!origin.empty()) request.set(boost::beast::http::field::origin, origin);
        }));
    boost::system::error_code error;
    socket->stream_.handshake("localhost", "/ws", error);
    if (error) socket.reset();
    return socket;
  }

  void Write(const std::string& text) {
    boost::system::error_code gone;
    stream_.write(net::buffer(text), gone);
  }

  /// Returns the next message; empty where the server has closed the connection.
  std::string Read() {
    boost::beast::flat_buffer buffer;
    boost::system::error_code gone;
    stream_.read(buffer, gone);
    return gone ? std::string() : boost::beast::buffers_to_string(buffer.data());
  }

 private:
  net::io_context io_;
  websocket::stream<net::ip::tcp::socket> stream_{io_};
};

}  // namespace trammel::panel

// A TCP connection that may speak TLS, one type for both: what stands on it is compiled once.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace trammel::machine {

/// Asio's asynchronous stream, for Beast's HTTP and WebSocket to stand on. Handlers run in its
/// io_context; those of their own executor are not meant.
class NetStream {
 public:
  using error_code = boost::system::error_code;
  using next_layer_type = boost::beast::tcp_stream;
  using executor_type = next_layer_type::executor_type;

  /// @param tls  null: plain. Else outlives the construction only: OpenSSL counts its references.
  NetStream(boost::asio::io_context& io, boost::asio::ssl::context* tls);
  ~NetStream();

  [[nodiscard]] executor_type get_executor() { return next_layer().get_executor(); }
  [[nodiscard]] next_layer_type& next_layer();
  [[nodiscard]] const next_layer_type& next_layer() const;

  /// The TLS session; null: plain.
  [[nodiscard]] SSL* tls();

  /// Does the client's part of the TLS handshake. REQUIRES tls().
  void AsyncHandshake(std::function<void(error_code)> done);

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(error_code, std::size_t)>(
        [this](auto handler, MutableBuffers all) {
          Read(std::move(all), Copyable(std::move(handler)));
        },
        token, All<MutableBuffers>(buffers));
  }

  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(error_code, std::size_t)>(
        [this](auto handler, ConstBuffers all) {
          Write(std::move(all), Copyable(std::move(handler)));
        },
        token, All<ConstBuffers>(buffers));
  }

 private:
  using MutableBuffers = std::vector<boost::asio::mutable_buffer>;
  using ConstBuffers = std::vector<boost::asio::const_buffer>;
  using Transferred = std::function<void(error_code, std::size_t)>;
  struct State;

  template <class To, class Buffers>
  static To All(const Buffers& buffers) {
    return To(boost::asio::buffer_sequence_begin(buffers),
              boost::asio::buffer_sequence_end(buffers));
  }

  /// Holds a handler that can only be moved for a std::function.
  template <class Handler>
  static auto Copyable(Handler handler) {
    return [held = std::make_shared<Handler>(std::move(handler))](error_code error, auto... more) {
      Handler mine(std::move(*held));
      mine(error, more...);
    };
  }

  void Read(MutableBuffers buffers, Transferred done);
  void Write(ConstBuffers buffers, Transferred done);
  void TearDown(boost::beast::role_type role, std::function<void(error_code)> done);

  // Found by Beast, which closes a connection through them.
  friend void teardown(boost::beast::role_type role, NetStream& stream, error_code& error);
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, NetStream& stream, Handler&& handler) {
    stream.TearDown(role, Copyable(std::forward<Handler>(handler)));
  }

  std::unique_ptr<State> state_;
};

}  // namespace trammel::machine

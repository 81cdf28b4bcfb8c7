// TCP connection with optional TLS, one type for both, so that code built on it is compiled once.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "machine/net/endpoint.h"

namespace trammel::machine {

/// Asynchronous stream of Asio, for Beast. Handlers run in its io_context; their own executors are
/// ignored.
class NetStream {
 public:
  using error_code = boost::system::error_code;
  using next_layer_type = boost::beast::tcp_stream;
  using executor_type = next_layer_type::executor_type;

  NetStream(boost::asio::io_context& io, Endpoint endpoint);
  ~NetStream();

  /// Resolves the host, connects, and performs the TLS handshake within the endpoint's limit.
  /// `done` receives the error, which names the server: kInput for an unusable certificate file, or
  /// kMachine; absent on success. Not called after Close().
  void AsyncConnect(std::function<void(std::optional<Error>)> done);

  /// Ends the connection, or the attempt; waiting handlers get operation_aborted.
  void Close();

  [[nodiscard]] executor_type get_executor() { return next_layer().get_executor(); }
  [[nodiscard]] next_layer_type& next_layer();
  [[nodiscard]] const next_layer_type& next_layer() const;

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

  /// Wraps a move-only handler for a std::function.
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

  // Found by Beast through ADL, to close a connection.
  friend void teardown(boost::beast::role_type role, NetStream& stream, error_code& error);
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, NetStream& stream, Handler&& handler) {
    stream.TearDown(role, Copyable(std::forward<Handler>(handler)));
  }

  std::shared_ptr<State> state_;  // shared with its handlers
};

}  // namespace trammel::machine

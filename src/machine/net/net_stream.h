// A TCP connection that may speak TLS, one type for both: what is built on it is compiled once.
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

/// Asio's asynchronous stream, for Beast to use. Handlers run in its io_context; executors of their
/// own are ignored.
class NetStream {
 public:
  using error_code = boost::system::error_code;
  using next_layer_type = boost::beast::tcp_stream;
  using executor_type = next_layer_type::executor_type;

  NetStream(boost::asio::io_context& io, Endpoint endpoint);
  ~NetStream();

  /// Looks the host up, connects, and does the TLS handshake within the endpoint's limit. `done`
  /// gets the error, which names the server: kInput for a certificate file that cannot be used, or
  /// kMachine; none where all went well. Not called after Close().
  void AsyncConnect(std::function<void(std::optional<Error>)> done);

  /// Ends the connection, or the attempt; handlers that wait get operation_aborted.
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

  std::shared_ptr<State> state_;  // its handlers share it
};

}  // namespace trammel::machine

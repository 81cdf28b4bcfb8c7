#include "machine/moonraker/net_stream.h"

#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <optional>

namespace trammel::machine {

namespace asio = boost::asio;
namespace beast = boost::beast;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;

struct NetStream::State {
  std::optional<beast::tcp_stream> plain;
  std::optional<TlsStream> tls;
};

NetStream::NetStream(asio::io_context& io, asio::ssl::context* tls)
    : state_(std::make_unique<State>()) {
  if (tls == nullptr) {
    state_->plain.emplace(io);
  } else {
    state_->tls.emplace(io, *tls);
  }
}

NetStream::~NetStream() = default;

NetStream::next_layer_type& NetStream::next_layer() {
  return state_->tls ? state_->tls->next_layer() : *state_->plain;
}

const NetStream::next_layer_type& NetStream::next_layer() const {
  return state_->tls ? state_->tls->next_layer() : *state_->plain;
}

SSL* NetStream::tls() { return state_->tls ? state_->tls->native_handle() : nullptr; }

void NetStream::AsyncHandshake(std::function<void(error_code)> done) {
  state_->tls->async_handshake(asio::ssl::stream_base::client, std::move(done));
}

void NetStream::Read(MutableBuffers buffers, Transferred done) {
  if (state_->tls) {
    state_->tls->async_read_some(buffers, std::move(done));
  } else {
    state_->plain->async_read_some(buffers, std::move(done));
  }
}

void NetStream::Write(ConstBuffers buffers, Transferred done) {
  if (state_->tls) {
    state_->tls->async_write_some(buffers, std::move(done));
  } else {
    state_->plain->async_write_some(buffers, std::move(done));
  }
}

void NetStream::TearDown(beast::role_type role, std::function<void(error_code)> done) {
  using beast::websocket::async_teardown;
  if (state_->tls) {
    async_teardown(role, *state_->tls, std::move(done));
  } else {
    async_teardown(role, *state_->plain, std::move(done));
  }
}

void teardown(beast::role_type role, NetStream& stream, NetStream::error_code& error) {
  using beast::websocket::teardown;
  if (stream.state_->tls) {
    teardown(role, *stream.state_->tls, error);
  } else {
    teardown(role, *stream.state_->plain, error);
  }
}

}  // namespace trammel::machine

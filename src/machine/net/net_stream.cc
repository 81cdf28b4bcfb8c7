#include "machine/net/net_stream.h"

#include <fmt/format.h>
#include <openssl/x509_vfy.h>

#include <boost/asio/error.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <chrono>
#include <mutex>
#include <thread>

#include "base/bug_note.h"

namespace trammel::machine {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace ssl = asio::ssl;
using asio::ip::tcp;
using boost::system::error_code;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;
using Found = std::vector<tcp::endpoint>;

/// Name look-up. The system call cannot be interrupted, so it runs in a thread that may outlive the
/// caller.
class LookUp : public std::enable_shared_from_this<LookUp> {
 public:
  using Done = std::function<void(error_code, Found)>;
  LookUp(asio::io_context& io, Done done) : work_(io.get_executor()), done_(std::move(done)) {}

  void Start(const HostAndPort& of) {
    std::thread([self = shared_from_this(), of] {
      error_code error = asio::error::no_recovery;  // in case of a bug
      Found found;
      (void)NoteBug([&] {
        asio::io_context own;
        for (const auto& entry :
             tcp::resolver(own).resolve(of.host, std::to_string(of.port), error)) {
          found.push_back(entry.endpoint());
        }
      });
      self->Finish(error, std::move(found));
    }).detach();
  }

  /// Cancels the wait for the result.
  void Cancel() {
    const std::lock_guard lock(mutex_);
    done_ = nullptr;
    work_.reset();
  }

 private:
  void Finish(error_code error, Found found) {
    const std::lock_guard lock(mutex_);
    if (!done_) return;
    asio::post(work_.get_executor(),
               [done = std::move(done_), error, found = std::move(found)] { done(error, found); });
    done_ = nullptr;
    work_.reset();
  }

  std::mutex mutex_;
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  Done done_;
};

Result<ssl::context> MakeTlsContext(const Endpoint& endpoint) {
  ssl::context context(ssl::context::tls_client);
  error_code error;
  context.set_options(ssl::context::default_workarounds | ssl::context::no_tlsv1 |
                      ssl::context::no_tlsv1_1);
  if (!endpoint.verify_certificate) {
    context.set_verify_mode(ssl::verify_none, error);
    return context;
  }
  context.set_verify_mode(ssl::verify_peer, error);
  const bool has_file = !endpoint.ca_file.empty();
  if (!has_file || endpoint.trust_system) context.set_default_verify_paths(error);
  if (!error && has_file) context.load_verify_file(endpoint.ca_file, error);
  if (error) {
    return Fail(
        fmt::format("cannot read the certificates in '{}': {}; it must be a PEM file with "
                    "the authority's or {}'s own certificate",
                    has_file ? endpoint.ca_file.string() : "the system's store", error.message(),
                    endpoint.server));
  }
  return context;
}

/// Sets the server name to request, which its certificate must contain.
Result<void> ExpectHost(SSL* session, const Endpoint& endpoint) {
  const char* const host = endpoint.host.c_str();
  error_code not_an_ip;
  asio::ip::make_address(host, not_an_ip);
  bool done = !not_an_ip || SSL_set_tlsext_host_name(session, host) == 1;
  if (done && endpoint.verify_certificate) {
    done = not_an_ip ? SSL_set1_host(session, host) == 1
                     : X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(session), host) == 1;
  }
  if (done) return {};
  return Fail(fmt::format("'{}' cannot be the name in a certificate", endpoint.host));
}

std::string LookUpFailure(const error_code& error, const Endpoint& endpoint) {
  return fmt::format(
      "cannot find a computer named '{}': {}; check the spelling and that it is switched on, or "
      "give its number (like 192.168.1.20)",
      endpoint.host, error.message());
}

std::string ConnectFailure(const error_code& error, const Endpoint& endpoint) {
  const std::string who = endpoint.Authority();
  if (error == asio::error::connection_refused) {
    return fmt::format(
        "{} refuses connections: nothing listens on that port; check that {} runs there and the "
        "port{}",
        who, endpoint.server, endpoint.port_hint);
  }
  if (error == beast::error::timeout || error == asio::error::timed_out) {
    return fmt::format(
        "{} did not answer within {:g} s; check that the computer is on and reachable from here, "
        "and that no firewall stands between",
        who, endpoint.time_limit_s);
  }
  return fmt::format("cannot connect to {}: {}; check the address and the network", who,
                     error.message());
}

std::string TlsFailure(SSL* session, const error_code& error, const Endpoint& endpoint) {
  if (const long verdict = SSL_get_verify_result(session); verdict != X509_V_OK) {
    return fmt::format(
        "{} does not prove who it is: {}; give its certificate or its authority's as the CA file, "
        "use the name that is in the certificate, or (only in a network that you trust) accept any "
        "certificate",
        endpoint.Authority(), X509_verify_cert_error_string(verdict));
  }
  return fmt::format("cannot set up TLS with {}: {}; if the server speaks plain HTTP there, use {}",
                     endpoint.Authority(), error.message(), endpoint.plain);
}

}  // namespace

struct NetStream::State : std::enable_shared_from_this<State> {
  State(asio::io_context& the_io, Endpoint the_endpoint)
      : io(the_io), endpoint(std::move(the_endpoint)) {}

  void Fail(std::string message, ErrorKind kind = ErrorKind::kMachine) {
    Finish(Error{kind, std::move(message)});
  }
  void Finish(std::optional<Error> error) {
    if (const auto last = std::exchange(done, nullptr)) last(std::move(error));
  }
  [[nodiscard]] beast::tcp_stream& socket() { return tls ? tls->next_layer() : *plain; }

  void Connect(const Found& found) {
    socket().expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(endpoint.time_limit_s)));
    socket().async_connect(found,
                           [self = shared_from_this()](error_code error, const tcp::endpoint&) {
                             if (!self->done) return;
                             if (error) return self->Fail(ConnectFailure(error, self->endpoint));
                             error_code ignored;
                             self->socket().socket().set_option(tcp::no_delay(true), ignored);
                             self->tls ? self->Secure() : self->Opened();
                           });
  }

  void Secure() {
    SSL* const session = tls->native_handle();
    if (const auto expected = ExpectHost(session, endpoint); !expected) {
      return Finish(expected.error());
    }
    tls->async_handshake(ssl::stream_base::client,
                         [self = shared_from_this(), session](error_code error) {
                           if (!self->done) return;
                           if (error) return self->Fail(TlsFailure(session, error, self->endpoint));
                           self->Opened();
                         });
  }

  void Opened() {
    socket().expires_never();
    Finish(std::nullopt);
  }

  asio::io_context& io;
  const Endpoint endpoint;
  std::optional<Error> cannot;  ///< why TLS is unavailable
  std::optional<beast::tcp_stream> plain;
  std::optional<TlsStream> tls;
  std::shared_ptr<LookUp> look_up;
  std::function<void(std::optional<Error>)> done;
};

NetStream::NetStream(asio::io_context& io, Endpoint endpoint)
    : state_(std::make_shared<State>(io, std::move(endpoint))) {
  if (state_->endpoint.tls) {
    auto context = MakeTlsContext(state_->endpoint);
    if (context) {
      state_->tls.emplace(io, *context);  // counts its references to the context
      return;
    }
    state_->cannot = context.error();
  }
  state_->plain.emplace(io);
}

NetStream::~NetStream() { Close(); }

void NetStream::AsyncConnect(std::function<void(std::optional<Error>)> done) {
  State& state = *state_;
  state.done = std::move(done);
  error_code a_name;
  const auto address = asio::ip::make_address(state.endpoint.host, a_name);
  if (state.cannot) {
    asio::post(state.io, [state = state_] { state->Finish(state->cannot); });
  } else if (!a_name) {
    state.Connect({tcp::endpoint(address, state.endpoint.port)});
  } else {
    state.look_up =
        std::make_shared<LookUp>(state.io, [self = state_](error_code error, const Found& found) {
          if (!self->done) return;
          if (error) return self->Fail(LookUpFailure(error, self->endpoint));
          self->Connect(found);
        });
    state.look_up->Start(state.endpoint);
  }
}

void NetStream::Close() {
  state_->done = nullptr;
  if (state_->look_up) state_->look_up->Cancel();
  state_->socket().close();
}

NetStream::next_layer_type& NetStream::next_layer() { return state_->socket(); }
const NetStream::next_layer_type& NetStream::next_layer() const { return state_->socket(); }

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

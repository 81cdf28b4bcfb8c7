#include "machine/net/byte_stream.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/bug_note.h"
#include "machine/net/host_clock.h"
#include "machine/net/wait_fd.h"

namespace trammel::machine {
namespace {

tl::unexpected<Error> Broken(std::string what) {
  return Fail(std::move(what), ErrorKind::kMachine);
}

tl::unexpected<Error> Stopped() { return Fail("stopped", ErrorKind::kInterrupted); }

std::string SystemText(int error) { return std::generic_category().message(error); }

struct FreeAddresses {
  void operator()(addrinfo* p) const { freeaddrinfo(p); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

/// A look-up cannot be interrupted, so it runs in a thread that may outlive its caller.
struct LookUp {
  std::string host;
  std::string port;
  int done_fd = eventfd(0, EFD_CLOEXEC);
  std::mutex mutex;
  int error = 0;
  Addresses addresses;
  std::optional<std::string> bug;

  LookUp() = default;
  LookUp(const LookUp&) = delete;
  LookUp& operator=(const LookUp&) = delete;
  ~LookUp() {
    if (done_fd >= 0) close(done_fd);
  }

  void Run() {
    auto thrown = NoteBug([this] { Ask(); });
    if (thrown) {
      const std::lock_guard lock(mutex);
      bug = std::move(thrown);
    }
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = write(done_fd, &one, sizeof one);
  }

 private:
  void Ask() {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = AI_ADDRCONFIG;
    addrinfo* found = nullptr;
    const int code = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
    const std::lock_guard lock(mutex);
    error = code;
    addresses.reset(found);
  }
};

Result<Addresses> FindAddresses(const ConnectOptions& options, double deadline_s,
                                const std::stop_token& stop) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* numeric = nullptr;
  const std::string port = std::to_string(options.port);
  if (getaddrinfo(options.host.c_str(), port.c_str(), &hints, &numeric) == 0) {
    return Addresses(numeric);
  }
  const auto look_up = std::make_shared<LookUp>();
  if (look_up->done_fd < 0) return Broken("the system has no file descriptor left");
  look_up->host = options.host;
  look_up->port = port;
  std::thread([look_up] { look_up->Run(); }).detach();
  switch (WaitForFd(look_up->done_fd, POLLIN, deadline_s, stop)) {
    case Waited::kStopped:
      return Stopped();
    case Waited::kTimeLimit:
      return Broken(fmt::format("no answer to the look-up of '{}' within {:g} s; check the network",
                                options.host, options.time_limit_s));
    case Waited::kReady:
      break;
  }
  const std::lock_guard lock(look_up->mutex);
  if (look_up->bug) {
    return Broken(
        fmt::format("a bug in trammel ended the look-up of '{}': {}", options.host, *look_up->bug));
  }
  if (look_up->error != 0 || !look_up->addresses) {
    return Broken(
        fmt::format("the host name '{}' is unknown ({}); check its spelling, or write its "
                    "address in numbers",
                    options.host, gai_strerror(look_up->error)));
  }
  return std::move(look_up->addresses);
}

class Socket {
 public:
  explicit Socket(int fd = -1) : fd_(fd) {}
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

Result<Socket> ConnectTo(const addrinfo& address, const ConnectOptions& options, double deadline_s,
                         const std::stop_token& stop) {
  Socket socket(::socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket.fd() < 0) return Broken(SystemText(errno));
  if (connect(socket.fd(), address.ai_addr, address.ai_addrlen) != 0) {
    if (errno != EINPROGRESS) return Broken(SystemText(errno));
    switch (WaitForFd(socket.fd(), POLLOUT, deadline_s, stop)) {
      case Waited::kStopped:
        return Stopped();
      case Waited::kTimeLimit:
        return Broken(
            fmt::format("no connection within {:g} s; check that the machine is on and "
                        "the address is right",
                        options.time_limit_s));
      case Waited::kReady:
        break;
    }
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(socket.fd(), SOL_SOCKET, SO_ERROR, &error, &size);
    if (error == ECONNREFUSED) {
      return Broken(
          fmt::format("connection refused: nothing listens on port {}; check that the "
                      "server runs there",
                      options.port));
    }
    if (error != 0) return Broken(SystemText(error));
  }
  return socket;
}

struct FreeContext {
  void operator()(SSL_CTX* p) const { SSL_CTX_free(p); }
};
struct FreeSession {
  void operator()(SSL* p) const { SSL_free(p); }
};

std::string TlsText() {
  const unsigned long code = ERR_get_error();
  const char* text = code == 0 ? nullptr : ERR_reason_error_string(code);
  return text == nullptr ? "no reason given" : text;
}

}  // namespace

struct ByteStream::State {
  Socket socket;
  std::unique_ptr<SSL_CTX, FreeContext> context;
  std::unique_ptr<SSL, FreeSession> session;  ///< null: plain

  Result<void> StartTls(const ConnectOptions& options, double deadline_s,
                        const std::stop_token& stop);
  Result<ReadResult> Receive(std::span<std::uint8_t> buffer, double deadline_s,
                             const std::stop_token& stop) const;
  Result<void> Send(std::string_view bytes, double deadline_s, const std::stop_token& stop) const;
  Result<void> SendPending(double deadline_s, const std::stop_token& stop) const;
  Result<ReadResult> ReceivePending(double deadline_s, const std::stop_token& stop) const;
};

Result<ByteStream::ReadResult> ByteStream::State::Receive(std::span<std::uint8_t> buffer,
                                                          double deadline_s,
                                                          const std::stop_token& stop) const {
  for (;;) {
    if (stop.stop_requested()) return Stopped();
    const ssize_t count = recv(socket.fd(), buffer.data(), buffer.size(), 0);
    if (count >= 0) return ReadResult{static_cast<std::size_t>(count), false};
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) {
      return Broken(fmt::format("the connection broke ({})", SystemText(errno)));
    }
    const Waited waited = WaitForFd(socket.fd(), POLLIN, deadline_s, stop);
    if (waited == Waited::kStopped) return Stopped();
    if (waited == Waited::kTimeLimit) return ReadResult{0, true};
  }
}

Result<void> ByteStream::State::Send(std::string_view bytes, double deadline_s,
                                     const std::stop_token& stop) const {
  while (!bytes.empty()) {
    // Without the flag a connection that the other side closed would end the process.
    const ssize_t count = send(socket.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) {
      return Broken(fmt::format("the connection broke ({})", SystemText(errno)));
    }
    const Waited waited = WaitForFd(socket.fd(), POLLOUT, deadline_s, stop);
    if (waited == Waited::kStopped) return Stopped();
    if (waited == Waited::kTimeLimit) return Broken("the server does not take the request");
  }
  return {};
}

/// OpenSSL works on memory here, so that waits and signals are as for a plain connection.
Result<void> ByteStream::State::SendPending(double deadline_s, const std::stop_token& stop) const {
  std::array<char, 4096> bytes{};
  BIO* out = SSL_get_wbio(session.get());
  for (int count = BIO_read(out, bytes.data(), bytes.size()); count > 0;
       count = BIO_read(out, bytes.data(), bytes.size())) {
    TRY(Send({bytes.data(), static_cast<std::size_t>(count)}, deadline_s, stop));
  }
  return {};
}

Result<ByteStream::ReadResult> ByteStream::State::ReceivePending(
    double deadline_s, const std::stop_token& stop) const {
  std::array<std::uint8_t, 16384> bytes{};
  auto read = Receive(bytes, deadline_s, stop);
  if (read && read->count > 0) {
    BIO_write(SSL_get_rbio(session.get()), bytes.data(), static_cast<int>(read->count));
  }
  return read;
}

Result<void> ByteStream::State::StartTls(const ConnectOptions& options, double deadline_s,
                                         const std::stop_token& stop) {
  context.reset(SSL_CTX_new(TLS_client_method()));
  if (!context) return Broken(fmt::format("TLS cannot be set up ({})", TlsText()));
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  if (options.verify_certificate) {
    SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
    SSL_CTX_set_default_verify_paths(context.get());
    if (!options.ca_file.empty() &&
        SSL_CTX_load_verify_locations(context.get(), options.ca_file.c_str(), nullptr) != 1) {
      return Broken(fmt::format("the certificates in '{}' cannot be read ({})",
                                options.ca_file.string(), TlsText()));
    }
  }
  session.reset(SSL_new(context.get()));
  BIO* in = BIO_new(BIO_s_mem());
  BIO* out = BIO_new(BIO_s_mem());
  if (!session || in == nullptr || out == nullptr) return Broken("out of memory");
  SSL_set_bio(session.get(), in, out);
  in6_addr numeric{};
  if (inet_pton(AF_INET, options.host.c_str(), &numeric) == 1 ||
      inet_pton(AF_INET6, options.host.c_str(), &numeric) == 1) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(session.get()), options.host.c_str());
  } else {
    SSL_set_tlsext_host_name(session.get(), options.host.c_str());
    SSL_set1_host(session.get(), options.host.c_str());
  }
  for (;;) {
    ERR_clear_error();
    const int done = SSL_connect(session.get());
    const int error = SSL_get_error(session.get(), done);
    TRY(SendPending(deadline_s, stop));
    if (done == 1) return {};
    if (error != SSL_ERROR_WANT_READ) {
      const long verified = SSL_get_verify_result(session.get());
      if (verified != X509_V_OK) {
        return Broken(
            fmt::format("its certificate is not trusted ({}); name the certificate's "
                        "file in the configuration, or use http://",
                        X509_verify_cert_error_string(verified)));
      }
      return Broken(fmt::format("it does not speak TLS as asked ({}); try http://", TlsText()));
    }
    auto read = TRY(ReceivePending(deadline_s, stop));
    if (read.timed_out) {
      return Broken(
          fmt::format("no TLS handshake within {:g} s; try http://", options.time_limit_s));
    }
    if (read.count == 0) return Broken("closed during the TLS handshake; try http://");
  }
}

ByteStream::ByteStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
ByteStream::ByteStream(ByteStream&&) noexcept = default;
ByteStream& ByteStream::operator=(ByteStream&&) noexcept = default;
ByteStream::~ByteStream() = default;

Result<ByteStream> ByteStream::Connect(const ConnectOptions& options, const std::stop_token& stop) {
  const double deadline_s = HostNow() + options.time_limit_s;
  auto addresses = TRY(FindAddresses(options, deadline_s, stop));
  Error last{ErrorKind::kMachine, "no address to connect to"};
  for (const addrinfo* address = addresses.get(); address != nullptr; address = address->ai_next) {
    auto socket = ConnectTo(*address, options, deadline_s, stop);
    if (!socket) {
      last = socket.error();
      if (last.kind == ErrorKind::kInterrupted) break;
      continue;
    }
    auto state = std::make_unique<State>();
    state->socket = std::move(*socket);
    if (options.tls) {
      TRY(state->StartTls(options, deadline_s, stop));
    }
    return ByteStream(std::move(state));
  }
  return tl::unexpected(last);
}

Result<void> ByteStream::Write(std::string_view bytes, double deadline_s,
                               const std::stop_token& stop) {
  if (!state_->session) return state_->Send(bytes, deadline_s, stop);
  // With memory behind it, everything is taken at once.
  if (SSL_write(state_->session.get(), bytes.data(), static_cast<int>(bytes.size())) <= 0) {
    return Broken(fmt::format("TLS failed while sending ({})", TlsText()));
  }
  return state_->SendPending(deadline_s, stop);
}

Result<ByteStream::ReadResult> ByteStream::Read(std::span<std::uint8_t> buffer, double deadline_s,
                                                const std::stop_token& stop) {
  if (!state_->session) return state_->Receive(buffer, deadline_s, stop);
  for (;;) {
    ERR_clear_error();
    const int count =
        SSL_read(state_->session.get(), buffer.data(), static_cast<int>(buffer.size()));
    if (count > 0) return ReadResult{static_cast<std::size_t>(count), false};
    const int error = SSL_get_error(state_->session.get(), count);
    if (error == SSL_ERROR_ZERO_RETURN) return ReadResult{};
    if (error != SSL_ERROR_WANT_READ) {
      return Broken(fmt::format("TLS failed while receiving ({})", TlsText()));
    }
    TRY(state_->SendPending(deadline_s, stop));
    auto read = state_->ReceivePending(deadline_s, stop);
    if (!read || read->timed_out || read->count == 0) return read;
  }
}

}  // namespace trammel::machine

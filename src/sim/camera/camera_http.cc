#include "sim/camera/camera_http.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <cctype>
#include <chrono>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "base/bug_note.h"
#include "base/thread_priority.h"

namespace trammel::sim {

bool IsOwnHost(std::string_view host) {
  if (host.empty()) return true;
  const bool v6 = host.front() == '[';
  const std::size_t name_end = v6 ? host.find(']') + 1 : std::min(host.find(':'), host.size());
  std::string name(host.substr(0, name_end));
  std::string_view port = host.substr(name.size());
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (!port.empty() && port.front() != ':') return false;
  if (!port.empty()) port.remove_prefix(1);
  const bool digits =
      std::all_of(port.begin(), port.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return digits && (name == "127.0.0.1" || name == "localhost" || name == "[::1]");
}

bool IsOwnOrigin(std::string_view origin) {
  if (origin.empty()) return true;
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) {
      const std::string_view host = origin.substr(scheme.size());
      return !host.empty() && IsOwnHost(host);
    }
  }
  return false;  // "null", an extension, a file
}

namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;
using net::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr auto kPatience = std::chrono::seconds(10);  // for a client that is idle or reads nothing
constexpr std::size_t kRequestBytes = 8192;
// Kernel's buffer for one client: a few frames, then they are dropped here.
constexpr int kSendBufferBytes = 256 * 1024;
constexpr std::size_t kMaxClients = 32;

SendTimes TimesOfSending() {
  return {
      MonotonicNow(),
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count()};
}

class Client;

// Data of the server for clients.
struct Hub {
  CameraHeaders headers;
  CameraHttp::OnSent on_sent;
  std::set<std::shared_ptr<Client>> clients;
  std::atomic<int> waiting = 0;  // streams and snapshots that want frames
  std::int64_t last_sent = -1;
};

// Connection: reads a request, then sends frames until either side ends it.
class Client : public std::enable_shared_from_this<Client> {
 public:
  Client(tcp::socket socket, Hub& hub)
      : socket_(std::move(socket)), patience_(socket_.get_executor()), hub_(hub) {
    ErrorCode ignored;
    socket_.set_option(net::socket_base::send_buffer_size(kSendBufferBytes), ignored);
    socket_.set_option(tcp::no_delay(true), ignored);
    parser_.header_limit(kRequestBytes);
  }

  void Start() {
    LosePatienceLater();
    http::async_read_header(socket_, buffer_, parser_,
                            [self = shared_from_this()](ErrorCode error, std::size_t) {
                              if (error) return self->Close();
                              self->Answer();
                            });
  }

  void Offer(const CameraPart& part) {
    if (request_.what == CameraRequest::What::kUnknown || closed_) return;
    if (!busy_) return Send(part);
    next_ = part;
  }

  void Close() {
    if (closed_) return;
    closed_ = true;
    if (request_.what != CameraRequest::What::kUnknown) --hub_.waiting;
    ErrorCode ignored;
    patience_.cancel();
    socket_.shutdown(tcp::socket::shutdown_both, ignored);
    socket_.close(ignored);
    hub_.clients.erase(shared_from_this());
  }

 private:
  void LosePatienceLater() {
    patience_.expires_after(kPatience);
    patience_.async_wait([self = shared_from_this()](ErrorCode error) {
      if (!error) self->Close();
    });
  }

  void Answer() {
    patience_.cancel();
    const auto field = [this](http::field name) {
      const auto value = parser_.get()[name];
      return std::string_view(value.data(), value.size());
    };
    if (!IsOwnHost(field(http::field::host)) || !IsOwnOrigin(field(http::field::origin))) {
      return Refuse(403, "Forbidden", "the camera is for this computer's own pages only\n");
    }
    if (parser_.get().method() != http::verb::get) {
      return Refuse(405, "Method Not Allowed", "the camera answers GET only\n");
    }
    const auto target = parser_.get().target();
    request_ = ParseTarget({target.data(), target.size()});
    if (request_.what == CameraRequest::What::kUnknown) {
      return Refuse(404, "Not Found", "there are /stream and /snapshot\n");
    }
    ++hub_.waiting;
    WatchForEnd();
    if (request_.what == CameraRequest::What::kSnapshot) return;
    text_ = StreamHead(hub_.headers);
    Write({net::buffer(text_)}, [](Client& client) { client.SendNext(); });
  }

  void Refuse(int status, const char* reason, const char* text) {
    text_ = PlainAnswer(status, reason, text);
    Write({net::buffer(text_)}, [](Client& client) { client.Close(); });
  }

  // Detects that the client closed the connection even while nothing is sent; it sends no more
  // data.
  void WatchForEnd() {
    socket_.async_read_some(net::buffer(ignored_),
                            [self = shared_from_this()](ErrorCode error, std::size_t) {
                              if (error) return self->Close();
                              self->WatchForEnd();
                            });
  }

  void Send(const CameraPart& part) {
    const SendTimes send = TimesOfSending();
    jpeg_ = part.jpeg;
    if (hub_.last_sent < part.frame) {
      hub_.last_sent = part.frame;
      hub_.on_sent(part, send.monotonic_s);
    }
    const auto picture = net::buffer(jpeg_->data(), part.half ? jpeg_->size() / 2 : jpeg_->size());
    if (request_.what == CameraRequest::What::kSnapshot) {
      text_ = SnapshotHead(hub_.headers, part, send);
      return Write({net::buffer(text_), picture}, [](Client& client) { client.Close(); });
    }
    text_ = PartHead(hub_.headers, request_.extra_headers, part, send);
    if (part.half) {
      return Write({net::buffer(text_), picture}, [](Client& client) { client.Close(); });
    }
    tail_ = PartTail(hub_.headers);
    Write({net::buffer(text_), picture, net::buffer(tail_)},
          [](Client& client) { client.SendNext(); });
  }

  void SendNext() {
    if (!next_) return;
    const CameraPart part = *std::exchange(next_, std::nullopt);
    Send(part);
  }

  void Write(const std::vector<net::const_buffer>& buffers, void (*then)(Client&)) {
    busy_ = true;
    LosePatienceLater();
    net::async_write(socket_, buffers,
                     [self = shared_from_this(), then](ErrorCode error, std::size_t) {
                       self->busy_ = false;
                       self->patience_.cancel();
                       if (error || self->closed_) return self->Close();
                       then(*self);
                     });
  }

  tcp::socket socket_;
  net::steady_timer patience_;
  Hub& hub_;
  boost::beast::flat_buffer buffer_{kRequestBytes};
  http::request_parser<http::empty_body> parser_;
  CameraRequest request_;
  bool busy_ = false;
  bool closed_ = false;
  std::array<char, 256> ignored_{};
  std::string text_;  // buffer of async_write: must outlive it
  std::string tail_;
  std::shared_ptr<const std::vector<std::uint8_t>> jpeg_;
  std::optional<CameraPart> next_;
};

class Server final : public CameraHttp {
 public:
  Server(CameraHeaders headers, OnSent on_sent) : acceptor_(io_), timer_(io_) {
    hub_.headers = headers;
    hub_.on_sent = std::move(on_sent);
  }
  ~Server() override {
    io_.stop();
    if (thread_.joinable()) thread_.join();
    for (const std::shared_ptr<Client>& client : std::exchange(hub_.clients, {})) client->Close();
  }

  Result<void> Start(int port) {
    const tcp::endpoint where(net::ip::address_v4::loopback(), static_cast<std::uint16_t>(port));
    ErrorCode error;
    acceptor_.open(where.protocol(), error);
    if (!error) acceptor_.set_option(net::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(where, error);
    if (!error) acceptor_.listen(net::socket_base::max_listen_connections, error);
    if (error) {
      return Fail(fmt::format("the virtual camera cannot listen on 127.0.0.1:{}: {}; choose "
                              "another port or 0 for a free one",
                              port, error.message()),
                  ErrorKind::kMachine);
    }
    port_ = acceptor_.local_endpoint().port();
    Accept();
    // An exception in a client's handler ends only that client.
    thread_ = std::thread([this] {
      RaiseThisThread(ThreadUrgency::kWorking);
      while (NoteBug([this] { io_.run(); })) {
      }
    });
    return {};
  }

  int port() const override { return port_; }
  bool wanted() const override { return hub_.waiting > 0; }

  void Publish(CameraPart part, double due_s) override {
    net::post(io_, [this, part = std::move(part), due_s]() mutable {
      queue_.emplace_back(due_s, std::move(part));
      if (queue_.size() == 1) Wait();
    });
  }

  void SetOpen(bool open) override {
    net::post(io_, [this, open] {
      open_ = open;
      if (open) return;
      const auto clients = hub_.clients;
      for (const std::shared_ptr<Client>& client : clients) client->Close();
    });
  }

 private:
  void Accept() {
    acceptor_.async_accept([this](ErrorCode error, tcp::socket socket) {
      if (error == net::error::operation_aborted) return;
      if (!error && open_ && hub_.clients.size() < kMaxClients) {
        const auto client = std::make_shared<Client>(std::move(socket), hub_);
        hub_.clients.insert(client);
        client->Start();
      }
      Accept();
    });
  }

  void Wait() {
    const double left_s = std::max(0.0, queue_.front().first - MonotonicNow());
    timer_.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(left_s)));
    timer_.async_wait([this](ErrorCode error) {
      if (error) return;
      const CameraPart part = std::move(queue_.front().second);
      queue_.pop_front();
      const auto clients = hub_.clients;
      for (const std::shared_ptr<Client>& client : clients) {
        if (NoteBug([&] { client->Offer(part); })) client->Close();
      }
      if (!queue_.empty()) Wait();
    });
  }

  net::io_context io_{1};
  tcp::acceptor acceptor_;
  net::steady_timer timer_;
  Hub hub_;
  std::deque<std::pair<double, CameraPart>> queue_;
  int port_ = 0;
  bool open_ = true;
  std::thread thread_;
};

}  // namespace

double MonotonicNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Result<std::unique_ptr<CameraHttp>> CameraHttp::Listen(int port, CameraHeaders headers,
                                                       OnSent on_sent) {
  auto server = std::make_unique<Server>(headers, std::move(on_sent));
  TRY(server->Start(port));
  return server;
}

namespace {

constexpr std::string_view kNoCache =
    "Cache-Control: no-store, no-cache, must-revalidate, proxy-revalidate, pre-check=0, "
    "post-check=0, max-age=0\r\nPragma: no-cache\r\nExpires: Mon, 3 Jan 2000 12:34:56 GMT\r\n";

std::string_view Boundary(CameraHeaders style) {
  return style == CameraHeaders::kNone ? "123456789000000000000987654321" : "boundarydonotcross";
}

// ustreamer's headers, of which a snapshot's end in "Timestamp" where a stream's end in "Time".
std::string TimesOf(CameraHeaders style, const char* ending, const CameraPart& part,
                    const SendTimes& send) {
  return fmt::format(
      "X-UStreamer-Online: true\r\nX-UStreamer-Width: {}\r\nX-UStreamer-Height: {}\r\n"
      "X-UStreamer-Grab-{}{}: {:.6f}\r\nX-UStreamer-Send-{}: {:.6f}\r\n",
      part.width_px, part.height_px, style == CameraHeaders::kUstreamer6 ? "Begin-" : "", ending,
      part.stamp_s, ending, send.monotonic_s);
}

}  // namespace

CameraRequest ParseTarget(std::string_view target) {
  CameraRequest request;
  const std::size_t mark = target.find('?');
  const std::string_view path = target.substr(0, mark);
  std::string_view action;
  std::string_view rest = mark == target.npos ? std::string_view() : target.substr(mark + 1);
  while (!rest.empty()) {
    const std::size_t end = rest.find('&');
    const std::string_view pair = rest.substr(0, end);
    if (pair.starts_with("action=")) action = pair.substr(7);
    if (pair == "extra_headers=1" || pair == "extra_headers=true") request.extra_headers = true;
    rest = end == rest.npos ? std::string_view() : rest.substr(end + 1);
  }
  if (path == "/stream" || (path == "/" && action == "stream")) {
    request.what = CameraRequest::What::kStream;
  } else if (path == "/snapshot" || (path == "/" && action == "snapshot")) {
    request.what = CameraRequest::What::kSnapshot;
  }
  return request;
}

std::string StreamHead(CameraHeaders style) {
  return fmt::format(
      "HTTP/1.0 200 OK\r\n{}Content-Type: multipart/x-mixed-replace;boundary={}\r\n\r\n--{}\r\n",
      style == CameraHeaders::kNone ? std::string_view("Connection: close\r\n") : kNoCache,
      Boundary(style), Boundary(style));
}

std::string PartHead(CameraHeaders style, bool extra_headers, const CameraPart& part,
                     const SendTimes& send) {
  std::string head =
      fmt::format("Content-Type: image/jpeg\r\nContent-Length: {}\r\n", part.jpeg->size());
  if (style == CameraHeaders::kNone) return head + "\r\n";
  head += fmt::format("X-Timestamp: {:.6f}\r\n", send.wall_s);
  return head + (extra_headers ? TimesOf(style, "Time", part, send) : "") + "\r\n";
}

std::string PartTail(CameraHeaders style) { return fmt::format("\r\n--{}\r\n", Boundary(style)); }

std::string SnapshotHead(CameraHeaders style, const CameraPart& part, const SendTimes& send) {
  std::string head = "HTTP/1.1 200 OK\r\nConnection: close\r\n";
  if (style != CameraHeaders::kNone) {
    head += kNoCache;
    head += fmt::format("X-Timestamp: {:.6f}\r\n", send.wall_s);
    head += TimesOf(style, "Timestamp", part, send);
  }
  return head +
         fmt::format("Content-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n", part.jpeg->size());
}

std::string PlainAnswer(int status, std::string_view reason, std::string_view text) {
  return fmt::format(
      "HTTP/1.1 {} {}\r\nConnection: close\r\nContent-Type: text/plain\r\n"
      "Content-Length: {}\r\n\r\n{}",
      status, reason, text.size(), text);
}

}  // namespace trammel::sim

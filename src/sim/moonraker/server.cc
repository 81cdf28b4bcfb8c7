#include "sim/moonraker/server.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <thread>
#include <utility>

#include "base/bug_note.h"
#include "base/text.h"
#include "base/thread_priority.h"
#include "sim/camera/camera_http.h"
#include "sim/moonraker/http_api.h"

namespace trammel::sim {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Tcp = net::ip::tcp;
using ErrorCode = beast::error_code;

constexpr std::size_t kLongestMessage = 4 << 20;
constexpr std::size_t kLongestHeader = 16 << 10;
constexpr std::uint64_t kLongestUpload = 64 << 20;
constexpr std::size_t kMaxWaiting = 20'000;  // messages that a client has not taken
constexpr std::size_t kMaxWaitingBytes = 64 << 20;
constexpr long kMaxConnections = 100;
constexpr auto kTick = std::chrono::milliseconds(3);

// Shared by each connection for its lifetime: the owners are counted.
using Place = std::shared_ptr<void>;

// Client of the hub: its outgoing messages, one write at a time. A client that does not read is
// disconnected.
class WebSocketSession : public Peer, public std::enable_shared_from_this<WebSocketSession> {
 public:
  /// @param through  to Klipper itself
  WebSocketSession(beast::tcp_stream stream, Hub& hub, Place place, bool authorised, bool through)
      : hub_(hub),
        place_(std::move(place)),
        socket_(std::move(stream)),
        authorised_(authorised),
        through_(through) {}
  ~WebSocketSession() override { Leave(); }

  void Accept(const http::request<http::string_body>& request) {
    beast::get_lowest_layer(socket_).expires_never();
    socket_.read_message_max(kLongestMessage);
    // A client that answers no ping for some minutes is gone.
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.text(true);
    socket_.async_accept(request, [self = shared_from_this(), this](const ErrorCode& error) {
      if (error) return;
      number_ = through_ ? hub_.OpenThrough(*this, authorised_) : hub_.Open(*this, authorised_);
      if (number_) Read();
    });
  }

  void Send(const std::string& message) override {
    if (waiting_.size() >= kMaxWaiting || bytes_ >= kMaxWaitingBytes) return Close();
    bytes_ += message.size();
    waiting_.push_back(message);
    if (waiting_.size() == 1) Write();
  }

  void Close() override {
    ErrorCode ignored;
    beast::get_lowest_layer(socket_).socket().close(ignored);
  }

 private:
  // Returns a handler of reads and writes: an error ends the connection.
  template <class Then>
  auto Unless(Then then) {
    return [self = shared_from_this(), this, then](const ErrorCode& error, std::size_t) {
      error ? Leave() : then();
    };
  }
  void Read() {
    socket_.async_read(buffer_, Unless([this] {
                         const std::string text = beast::buffers_to_string(buffer_.data());
                         buffer_.clear();
                         if (number_) hub_.Receive(*number_, text);
                         Read();
                       }));
  }
  void Write() {
    socket_.async_write(net::buffer(waiting_.front()), Unless([this] {
                          bytes_ -= waiting_.front().size();
                          waiting_.pop_front();
                          if (!waiting_.empty()) Write();
                        }));
  }
  void Leave() {
    if (number_) hub_.Close(*number_);
    number_.reset();
  }

  Hub& hub_;
  Place place_;
  websocket::stream<beast::tcp_stream> socket_;
  bool authorised_;
  bool through_;
  beast::flat_buffer buffer_;
  std::optional<std::uint64_t> number_;
  std::deque<std::string> waiting_;
  std::size_t bytes_ = 0;
};

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(Tcp::socket socket, Hub& hub, Place place)
      : place_(std::move(place)), stream_(std::move(socket)), hub_(hub) {}

  void Read() {
    parser_.emplace();
    parser_->body_limit(kLongestUpload);
    parser_->header_limit(kLongestHeader);
    stream_.expires_after(std::chrono::seconds(60));
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const ErrorCode& error, std::size_t) {
                       if (!error) self->Answer();
                     });
  }

 private:
  void Answer() {
    const http::request<http::string_body>& message = parser_->get();
    HttpRequest request;
    request.method = std::string(message.method_string());
    request.target = std::string(message.target());
    request.body = message.body();
    for (const auto& field : message) {
      request.headers[LowerCase(field.name_string())] = std::string(field.value());
    }
    const auto header = [&request](const char* name) {
      const auto field = request.headers.find(name);
      return field == request.headers.end() ? std::string() : field->second;
    };
    if (!IsOwnHost(header("host")) || !IsOwnOrigin(header("origin"))) {
      return Write({403, "text/plain", "only for programs and pages of this computer\n"}, false,
                   message.version());
    }
    const std::string path = ParseTarget(request.target).path;
    const bool through = path == "/klippysocket";
    if (websocket::is_upgrade(message) && (path == "/websocket" || through)) {
      const bool authorised = IsAuthorised(hub_, request);
      std::make_shared<WebSocketSession>(std::move(stream_), hub_, place_, authorised, through)
          ->Accept(message);
      return;
    }
    // A script may take minutes.
    stream_.expires_never();
    const bool keep_alive = message.keep_alive();
    const unsigned version = message.version();
    AnswerHttp(hub_, request,
               [self = shared_from_this(), keep_alive, version](const HttpResponse& response) {
                 self->Write(response, keep_alive, version);
               });
  }

  void Write(const HttpResponse& response, bool keep_alive, unsigned version) {
    auto message = std::make_shared<http::response<http::string_body>>();
    message->version(version);
    message->result(static_cast<unsigned>(response.status));
    message->set(http::field::server, "trammel virtual printer");
    message->set(http::field::content_type, response.content_type);
    message->keep_alive(keep_alive);
    message->body() = response.body;
    message->prepare_payload();
    http::async_write(stream_, *message,
                      [self = shared_from_this(), message](const ErrorCode& error, std::size_t) {
                        if (!error && message->keep_alive()) self->Read();
                      });
  }

  Place place_;
  beast::tcp_stream stream_;
  Hub& hub_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
};

}  // namespace

struct PrinterServer::Sockets {
  Sockets(MachineHost& machine, ServerOptions given)
      : options(std::move(given)), hub(machine, options.hub) {}

  void AcceptTcp() {
    tcp.async_accept([this](const ErrorCode& error, Tcp::socket socket) {
      if (error == net::error::operation_aborted) return;
      if (!error && !hub.refuses() && places.use_count() <= kMaxConnections) {
        ErrorCode ignored;
        socket.set_option(Tcp::no_delay(true), ignored);
        (void)NoteBug(
            [&] { std::make_shared<HttpSession>(std::move(socket), hub, places)->Read(); });
      }
      AcceptTcp();
    });
  }

  void Tick() {
    (void)NoteBug([this] { hub.Tick(MonotonicNow()); });
    timer.expires_after(kTick);
    timer.async_wait([this](const ErrorCode& error) {
      if (!error) Tick();
    });
  }

  Result<void> Listen() {
    ErrorCode error;
    const Tcp::endpoint address(net::ip::address_v4::loopback(), options.port);
    tcp.open(address.protocol(), error);
    if (!error) tcp.set_option(Tcp::acceptor::reuse_address(true), error);
    if (!error) tcp.bind(address, error);
    if (!error) tcp.listen(net::socket_base::max_listen_connections, error);
    if (error) {
      return Fail(fmt::format("cannot listen on 127.0.0.1:{}: {}; choose another --port",
                              options.port, error.message()),
                  ErrorKind::kMachine);
    }
    AcceptTcp();
    Tick();
    return {};
  }

  // The sessions are owned by the context's handlers and call the hub when destroyed: it is
  // destroyed last.
  ServerOptions options;
  Hub hub;
  Place places = std::make_shared<int>(0);
  net::io_context context{1};
  Tcp::acceptor tcp{context};
  net::steady_timer timer{context};
  std::thread thread;
};

PrinterServer::PrinterServer(std::unique_ptr<Sockets> sockets) : sockets_(std::move(sockets)) {}

Result<std::unique_ptr<PrinterServer>> PrinterServer::Start(MachineHost& machine,
                                                            ServerOptions options) {
  auto sockets = std::make_unique<Sockets>(machine, std::move(options));
  TRY(sockets->Listen());
  Sockets& running = *sockets;
  // An exception in a session's handler ends that session: nothing else holds it.
  running.thread = std::thread([&running] {
    RaiseThisThread(ThreadUrgency::kWorking);  // a printer's firmware keeps its own time
    while (NoteBug([&running] { running.context.run(); })) {
    }
  });
  return std::unique_ptr<PrinterServer>(new PrinterServer(std::move(sockets)));
}

PrinterServer::~PrinterServer() {
  sockets_->context.stop();
  sockets_->thread.join();
  sockets_->hub.Abandon();
}

void PrinterServer::Inject(ServerFaults faults) {
  net::post(sockets_->context, [this, faults]() mutable {
    Hub& hub = sockets_->hub;
    if (faults.close_at_s) *faults.close_at_s += hub.time_s();
    if (faults.silent_from_s) *faults.silent_from_s += hub.time_s();
    hub.SetFaults(faults);
  });
}

std::uint16_t PrinterServer::port() const { return sockets_->tcp.local_endpoint().port(); }

}  // namespace trammel::sim

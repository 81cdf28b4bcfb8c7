#include "panel/http_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "base/bug_note.h"
#include "base/text.h"

namespace trammel::panel {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Tcp = net::ip::tcp;
using ErrorCode = beast::error_code;
using Empty = http::request_parser<http::empty_body>;
using Message = http::response<http::string_body>;

constexpr std::uint64_t kSmallBody = 1 << 20;

auto Seconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(seconds));
}

std::string_view View(boost::string_view text) { return {text.data(), text.size()}; }

std::optional<std::string> Unescaped(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      const std::string digits(text.substr(i + 1, 2));
      if (digits.size() < 2 || digits.find_first_not_of("0123456789abcdefABCDEF") != digits.npos) {
        return std::nullopt;
      }
      c = static_cast<char>(std::stoi(digits, nullptr, 16));
      i += 2;
    }
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) return std::nullopt;
    plain += c;
  }
  return plain;
}

}  // namespace

HttpAnswer HttpError(unsigned status, const std::string& message) {
  return {.status = status,
          .body = nlohmann::json{{"error", message}}.dump(
              -1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

bool ParseTarget(std::string_view target, HttpRequest& request) {
  const std::size_t mark = target.find('?');
  const auto path = Unescaped(target.substr(0, mark));
  if (!path || !path->starts_with('/') || path->find("..") != std::string::npos) return false;
  request.path = *path;
  std::string_view rest = mark == std::string_view::npos ? "" : target.substr(mark + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    const std::size_t equals = pair.find('=');
    const auto name = Unescaped(pair.substr(0, equals));
    const auto value =
        Unescaped(equals == std::string_view::npos ? std::string_view() : pair.substr(equals + 1));
    if (!name || !value) return false;
    request.query.emplace(*name, *value);
  }
  return true;
}

namespace {

using Stream = beast::tcp_stream;

// Returns the IPv4 address that an IPv6 socket reports as ::ffff:a.b.c.d.
net::ip::address Plain(const net::ip::address& address) {
  if (!address.is_v6() || !address.to_v6().is_v4_mapped()) return address;
  return net::ip::make_address_v4(net::ip::v4_mapped, address.to_v6());
}

// Adds to a counter for as long as it lives.
class Counted {
 public:
  Counted(std::size_t& counter, std::size_t amount) : counter_(counter), amount_(amount) {
    counter_ += amount_;
  }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  ~Counted() { counter_ -= amount_; }

 private:
  std::size_t& counter_;
  std::size_t amount_;
};

// Keeps an entry in a set for as long as it lives.
template <class T>
class Listed {
 public:
  Listed(std::set<T>& all, T entry) : all_(all), entry_(std::move(entry)) { all_.insert(entry_); }
  Listed(const Listed&) = delete;
  Listed& operator=(const Listed&) = delete;
  ~Listed() { all_.erase(entry_); }

 private:
  std::set<T>& all_;
  T entry_;
};

// WebSocket of one client: texts wait while one is written.
struct Client {
  explicit Client(Stream stream) : socket(std::move(stream)) {}
  websocket::stream<Stream> socket;
  std::deque<std::string> waiting = {};
  std::size_t bytes = 0;
  bool writing = false;
  std::size_t answering = 0;  // messages
};

}  // namespace

class HttpServer::Impl {
 public:
  Impl(HttpServerOptions options, Answers answers)
      : options_(std::move(options)), answers_(std::move(answers)), acceptor_(io_) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { clients_.clear(); }  // their sockets are of io_

  Result<void> Open() {
    ErrorCode error;
    const auto address = net::ip::make_address(options_.address, error);
    if (error) {
      return Fail(
          fmt::format("'{}' is no address to listen at: give one in numbers, such as "
                      "127.0.0.1 or 0.0.0.0",
                      options_.address));
    }
    const Tcp::endpoint place(address, options_.port);
    acceptor_.open(place.protocol(), error);
    if (!error) acceptor_.set_option(net::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(place, error);
    if (!error) acceptor_.listen(net::socket_base::max_listen_connections, error);
    if (!error) return {};
    return Fail(fmt::format("cannot listen at {} port {}: {}; choose another port",
                            options_.address, options_.port, error.message()));
  }

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

  void Run(const std::stop_token& stop) {
    net::co_spawn(io_, Accept(), net::detached);
    const std::stop_callback asked(stop, [this] { net::post(io_, [this] { Close(); }); });
    // A bug in one connection, or no memory for it, ends that connection alone.
    while (NoteBug([this] { io_.run(); })) {
    }
    pool_.join();
    urgent_.join();
  }

  void Broadcast(std::string message) {
    net::post(io_, [this, text = std::move(message)] {
      for (const auto& client : std::set(clients_)) Send(client, text);
    });
  }

 private:
  // A connection's share of the limits, returned at its end.
  class Place {
   public:
    Place(Impl& server, std::string address) : server_(server), address_(std::move(address)) {
      ++server_.connections_;
      ++server_.of_address_[address_];
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    ~Place() {
      --server_.connections_;
      if (--server_.of_address_[address_] == 0) server_.of_address_.erase(address_);
    }

   private:
    Impl& server_;
    std::string address_;
  };

  void Close() {
    constexpr double kPatience_s = 2;  // for answers under way
    closing_ = true;
    ErrorCode ignored;
    acceptor_.close(ignored);
    for (Stream* const stream : streams_) stream->cancel();
    for (const auto& client : clients_) beast::get_lowest_layer(client->socket).cancel();
    if (connections_ == 0) return;
    patience_.expires_after(Seconds(kPatience_s));
    patience_.async_wait([this](const ErrorCode& error) {
      if (!error) io_.stop();
    });
  }

  net::awaitable<void> Accept() {
    constexpr double kPause_s = 0.1;  // out of files
    while (!closing_) {
      ErrorCode error;
      Tcp::socket socket =
          co_await acceptor_.async_accept(net::redirect_error(net::use_awaitable, error));
      if (closing_) break;
      if (error) {
        net::steady_timer pause(io_, Seconds(kPause_s));
        co_await pause.async_wait(net::redirect_error(net::use_awaitable, error));
        continue;
      }
      const auto peer = socket.remote_endpoint(error);
      if (error) continue;
      const net::ip::address from = Plain(peer.address());
      const std::string address = from.to_string();
      const auto found = of_address_.find(address);
      const bool many = found != of_address_.end() && !from.is_loopback() &&
                        found->second >= options_.limits.connections_of_address;
      if (many || connections_ >= options_.limits.connections) continue;  // closes it
      net::co_spawn(io_, Count(Stream(std::move(socket)), address), net::detached);
    }
  }

  // Runs work on threads that answer, and comes back with what it changed. False: a bug, noted.
  static net::awaitable<bool> Working(net::thread_pool& pool, std::function<void()> work) {
    co_return co_await net::co_spawn(
        pool,
        [](const std::function<void()>& work) -> net::awaitable<bool> {
          co_return !NoteBug(work);
        }(work),
        net::use_awaitable);
  }

  net::awaitable<void> Count(Stream stream, std::string address) {
    {
      const Place place(*this, address);
      co_await Serve(std::move(stream), address);
    }
    if (closing_ && connections_ == 0) patience_.cancel();
  }

  net::awaitable<void> Serve(Stream stream, std::string address) {
    std::optional<http::request<http::empty_body>> upgrade;
    {
      const Listed listed(streams_, &stream);
      beast::flat_buffer buffer;
      while (!closing_ && co_await ServeOne(stream, buffer, address, upgrade)) {
      }
    }
    if (upgrade) co_return co_await Talk(std::move(stream), std::move(*upgrade));
    ErrorCode ignored;
    stream.socket().shutdown(Tcp::socket::shutdown_both, ignored);
  }

  // Answers one request. False: the connection ends, or becomes a WebSocket.
  net::awaitable<bool> ServeOne(Stream& stream, beast::flat_buffer& buffer,
                                const std::string& address,
                                std::optional<http::request<http::empty_body>>& upgrade) {
    ErrorCode error;
    auto head = std::make_unique<Empty>();
    head->header_limit(static_cast<std::uint32_t>(options_.limits.header_bytes));
    head->body_limit(options_.limits.body_bytes);
    stream.expires_after(Seconds(options_.limits.header_s));
    co_await http::async_read_header(stream, buffer, *head,
                                     net::redirect_error(net::use_awaitable, error));
    if (error == http::error::body_limit) co_return co_await Refuse(stream, *head, TooLarge());
    if (error) co_return false;
    HttpRequest request;
    if (auto denied = Check(*head, address, request)) {
      co_return co_await Refuse(stream, *head, *denied);
    }
    if (websocket::is_upgrade(head->get())) {
      if (request.path != "/ws")
        co_return co_await Refuse(stream, *head, HttpError(404, "it is at /ws"));
      upgrade = head->release();
      co_return false;
    }
    const bool last = !head->keep_alive();
    const unsigned version = head->get().version();
    const std::uint64_t length = head->content_length().value_or(0);
    const bool large = length > kSmallBody || head->chunked();
    if (large && bodies_ >= options_.limits.bodies) {
      co_return co_await Refuse(stream, *head,
                                HttpError(503, "other uploads are under way: try again"));
    }
    const Counted large_body(bodies_,
                             large ? 1 : 0);  // until it is answered: a printer may be slow
    if (!head->is_done()) {
      http::request_parser<http::string_body> whole(std::move(*head));
      error = co_await ReadBody(stream, buffer, whole);
      if (error == http::error::body_limit) {
        co_return co_await Write(stream, TooLarge(), version, true, request) && false;
      }
      if (error) co_return false;
      request.body = std::move(whole.get().body());
    }
    stream.expires_never();
    HttpAnswer answer;
    if (!co_await Working(pool_, [&] { answer = answers_.http(request); })) {
      answer = HttpError(500, "this is a bug in trammel; its log has more");
    }
    request.body = {};
    if (answer_bytes_ > 0 && answer_bytes_ + answer.body.size() > options_.limits.answer_bytes) {
      answer = HttpError(503, "others are being answered: try again");
    }
    const Counted counted(answer_bytes_, answer.body.size());
    co_return co_await Write(stream, std::move(answer), version, last, request) && !last;
  }

  // Reads a body in pieces, each within a time of its own: a phone may be gone.
  net::awaitable<ErrorCode> ReadBody(Stream& stream, beast::flat_buffer& buffer,
                                     http::request_parser<http::string_body>& whole) {
    ErrorCode error;
    const auto end = std::chrono::steady_clock::now() + Seconds(options_.limits.body_s);
    while (!error && !whole.is_done()) {
      if (std::chrono::steady_clock::now() > end) co_return net::error::timed_out;
      stream.expires_after(Seconds(options_.limits.piece_s));
      co_await http::async_read_some(stream, buffer, whole,
                                     net::redirect_error(net::use_awaitable, error));
    }
    co_return error;
  }

  static HttpAnswer TooLarge() {
    return HttpError(413, "the upload is too large: a photo has at most 64 MB");
  }

  // Fills the request from its head. Returns the refusal, if it is refused.
  std::optional<HttpAnswer> Check(const Empty& head, const std::string& address,
                                  HttpRequest& request) const {
    const auto& message = head.get();
    const auto field = [&](auto name) { return View(message[name]); };
    request.method = std::string(View(message.method_string()));
    request.host = HostName(field(http::field::host));
    const std::string_view type = field(http::field::content_type);
    request.content_type =
        LowerCase(type.substr(0, std::min(type.find_first_of("; "), type.size())));
    const bool upgrades = websocket::is_upgrade(message);
    // A proxy on this computer passes on the address that it saw.
    const bool proxied = net::ip::make_address(address).is_loopback();
    const std::string_view behind = field("X-Real-IP");
    if (!IsNearby(proxied && !behind.empty() ? behind : std::string_view(address))) {
      return HttpError(403, "this panel answers computers of its own network only");
    }
    if (auto denial =
            CheckRequest({request.method, field(http::field::host), field(http::field::origin),
                          field("Sec-Fetch-Site"), request.content_type, upgrades},
                         options_.guard)) {
      return HttpError(denial->status, denial->message);
    }
    if (!ParseTarget(View(message.target()), request)) return HttpError(400, "not a path");
    if (request.method == "GET" || request.method == "HEAD" || request.method == "POST") return {};
    return HttpError(405, "only GET and POST are answered");
  }

  // Answers before the body was read, which ends the connection.
  net::awaitable<bool> Refuse(Stream& stream, const Empty& head, const HttpAnswer& answer) {
    HttpRequest request;
    co_await Write(stream, answer, head.get().version() != 0 ? head.get().version() : 11, true,
                   request);
    // A client that still sends would lose the answer with the connection.
    ErrorCode error;
    std::array<char, 4096> rest{};
    stream.socket().shutdown(Tcp::socket::shutdown_send, error);
    constexpr double kPatience_s = 2;
    stream.expires_after(Seconds(kPatience_s));
    for (std::uint64_t read = 0; !error && read < 4 * kSmallBody;) {
      read += co_await stream.async_read_some(net::buffer(rest),
                                              net::redirect_error(net::use_awaitable, error));
    }
    co_return false;
  }

  net::awaitable<bool> Write(Stream& stream, HttpAnswer answer, unsigned version, bool last,
                             const HttpRequest& request) {
    Message message(http::int_to_status(answer.status), version);
    message.set(http::field::content_type, answer.content_type);
    message.set("X-Content-Type-Options", "nosniff");
    message.set("Referrer-Policy", "no-referrer");
    message.set("Cross-Origin-Resource-Policy", "same-origin");
    message.set(http::field::cache_control, "no-store");
    message.set("Content-Security-Policy", ContentSecurityPolicy(request.host));
    for (const auto& [name, value] : answer.fields) message.set(name, value);
    message.keep_alive(!last);
    message.body() = std::move(answer.body);
    message.prepare_payload();
    if (request.method == "HEAD") message.body().clear();
    ErrorCode error;
    http::response_serializer<http::string_body> out(message);
    while (!error && !out.is_done()) {
      stream.expires_after(Seconds(options_.limits.piece_s));
      co_await http::async_write_some(stream, out, net::redirect_error(net::use_awaitable, error));
    }
    co_return !error;
  }

  net::awaitable<void> Talk(Stream stream, http::request<http::empty_body> request) {
    stream.expires_never();
    const auto client = std::make_shared<Client>(std::move(stream));
    auto& socket = client->socket;
    socket.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket.read_message_max(options_.limits.message_bytes);
    ErrorCode error;
    co_await socket.async_accept(request, net::redirect_error(net::use_awaitable, error));
    if (error || closing_) co_return;
    socket.text(true);
    const Listed listed(clients_, client);
    while (!error && !closing_) {
      beast::flat_buffer buffer;
      co_await socket.async_read(buffer, net::redirect_error(net::use_awaitable, error));
      if (error) break;
      // One at a time would let a status wait behind a photo that is measured.
      if (client->answering >= options_.limits.messages) break;
      net::co_spawn(io_, AnswerOne(client, beast::buffers_to_string(buffer.data())), net::detached);
    }
    beast::get_lowest_layer(socket).close();
  }

  net::awaitable<void> AnswerOne(std::shared_ptr<Client> client, std::string text) {
    const Counted counted(client->answering, 1);
    net::thread_pool& pool = answers_.is_urgent && answers_.is_urgent(text) ? urgent_ : pool_;
    std::string answer;
    if (co_await Working(pool, [&] { answer = answers_.message(text); }) && !answer.empty()) {
      Send(client, answer);
    }
  }

  void Send(const std::shared_ptr<Client>& client, const std::string& text) {
    if (client->bytes + text.size() > options_.limits.unread_bytes && client->writing) {
      beast::get_lowest_layer(client->socket).cancel();
      return;
    }
    client->bytes += text.size();
    client->waiting.push_back(text);
    if (client->writing) return;
    client->writing = true;
    net::co_spawn(io_, WriteAll(client), net::detached);
  }

  static net::awaitable<void> WriteAll(std::shared_ptr<Client> client) {
    ErrorCode error;
    while (!error && !client->waiting.empty()) {
      const std::string text = std::move(client->waiting.front());
      client->waiting.pop_front();
      co_await client->socket.async_write(net::buffer(text),
                                          net::redirect_error(net::use_awaitable, error));
      client->bytes -= text.size();
    }
    client->writing = false;
  }

  const HttpServerOptions options_;
  const Answers answers_;
  bool closing_ = false;
  std::size_t connections_ = 0;
  std::size_t bodies_ = 0;
  std::size_t answer_bytes_ = 0;
  std::map<std::string, std::size_t> of_address_;
  std::set<Stream*> streams_;
  std::set<std::shared_ptr<Client>> clients_;
  net::io_context io_{1};  // behind what its coroutines use at their end
  net::thread_pool pool_{4};
  net::thread_pool urgent_{2};
  Tcp::acceptor acceptor_;
  net::steady_timer patience_{io_};
};

HttpServer::HttpServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HttpServer::~HttpServer() = default;

Result<std::unique_ptr<HttpServer>> HttpServer::Listen(HttpServerOptions options, Answers answers) {
  auto impl = std::make_unique<Impl>(std::move(options), std::move(answers));
  TRY(impl->Open());
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(impl)));
}

std::uint16_t HttpServer::port() const { return impl_->port(); }

void HttpServer::Run(const std::stop_token& stop) { impl_->Run(stop); }

void HttpServer::Broadcast(std::string message) { impl_->Broadcast(std::move(message)); }

}  // namespace trammel::panel

#include "service/local_socket.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <list>
#include <optional>
#include <utility>
#include <vector>

#include "base/bounded_json.h"
#include "base/bug_note.h"
#include "machine/net/host_clock.h"
#include "machine/net/wait_fd.h"
#include "session/run_journal.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using machine::RpcAnswer;
using nlohmann::json;

constexpr std::size_t kMostClients = 16;
constexpr std::size_t kLongestRequest = std::size_t{64} << 10;
constexpr std::size_t kLongestAnswer = std::size_t{16} << 20;
constexpr int kLook_ms = 200;
constexpr double kPatience_s = 10;

// A file descriptor that is closed with its object.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] int Release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

struct Client {
  explicit Client(int fd) : socket(fd) {}
  Descriptor socket;
  double heard_s = machine::HostNow();
  std::string incoming = {};
  std::string outgoing = {};
};

Result<sockaddr_un> AddressOf(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& text = path.native();
  if (text.size() >= sizeof address.sun_path) {
    return Fail(
        fmt::format("{}: is too long for a socket's path; XDG_STATE_HOME names another "
                    "place",
                    text));
  }
  std::copy(text.begin(), text.end(), address.sun_path);
  return address;
}

// -1 where nobody listens there.
int Connected(const sockaddr_un& address) {
  Descriptor client(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (client.get() < 0) return -1;
  const auto* const generic = reinterpret_cast<const sockaddr*>(&address);
  return connect(client.get(), generic, sizeof address) == 0 ? client.Release() : -1;
}

// False where the client has gone.
bool ReadSome(Client& client) {
  std::array<char, 4096> bytes{};
  const ssize_t count = read(client.socket.get(), bytes.data(), bytes.size());
  if (count < 0) return errno == EINTR || errno == EAGAIN;
  client.incoming.append(bytes.data(), static_cast<std::size_t>(count));
  client.heard_s = machine::HostNow();
  return count > 0;
}

bool WriteSome(Client& client) {
  const ssize_t count =
      send(client.socket.get(), client.outgoing.data(), client.outgoing.size(), MSG_NOSIGNAL);
  if (count < 0) return errno == EINTR || errno == EAGAIN;
  client.outgoing.erase(0, static_cast<std::size_t>(count));
  return true;
}

bool AnswerLines(Client& client, const machine::RequestHandler& answer) {
  for (std::size_t end = 0; (end = client.incoming.find('\n')) != std::string::npos;) {
    const std::string said = AnswerLine(std::string_view(client.incoming).substr(0, end), answer);
    client.incoming.erase(0, end + 1);
    if (!said.empty()) client.outgoing += said + "\n";
  }
  return client.incoming.size() <= kLongestRequest && client.outgoing.size() <= kLongestAnswer;
}

// Whether the client stays.
bool ServeClient(Client& client, short events, const machine::RequestHandler& answer) {
  if ((events & POLLOUT) != 0 && !WriteSome(client)) return false;
  if ((events & (POLLIN | POLLHUP | POLLERR)) == 0) return true;
  return ReadSome(client) && AnswerLines(client, answer);
}

void DropLongestSilent(std::list<Client>& clients) {
  const auto silent = std::ranges::min_element(clients, {}, &Client::heard_s);
  if (silent != clients.end()) clients.erase(silent);
}

json Refusal(int code, const std::string& message) {
  return {{"code", code}, {"message", message}};
}

}  // namespace

fs::path LocalSocketPath(const fs::path& state_folder, std::string_view address) {
  // The hash at the end of the lock's name alone: a socket's path has little more than 100 bytes.
  const std::string name = files::LockPath({}, address).stem().string();
  return state_folder / fmt::format("serve{}.sock", name.substr(name.rfind('-')));
}

std::string AnswerLine(std::string_view line, const machine::RequestHandler& answer) {
  constexpr int kParseError = -32700;
  constexpr int kInvalidRequest = -32600;
  json reply = {{"jsonrpc", "2.0"}, {"id", nullptr}};
  const auto request = ParseBoundedJson(line, "the request", {.most_bytes = kLongestRequest});
  if (!request) {
    reply["error"] = Refusal(kParseError, request.error().message);
  } else if (!request->is_object() || request->value("jsonrpc", json()) != "2.0" ||
             !request->value("method", json()).is_string() ||
             request->value("id", json()).is_structured()) {
    reply["error"] = Refusal(kInvalidRequest, "the request is no JSON-RPC 2.0");
  } else {
    const RpcAnswer said =
        answer((*request)["method"].get<std::string>(), request->value("params", json::object()));
    if (!request->contains("id")) return {};
    reply["id"] = (*request)["id"];
    if (said.kind == RpcAnswer::Kind::kResult) {
      reply["result"] = said.result;
    } else {
      reply["error"] = Refusal(said.code, said.message);
    }
  }
  return reply.dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<std::unique_ptr<LocalSocket>> LocalSocket::Listen(const fs::path& path,
                                                         machine::RequestHandler answer) {
  const auto address = AddressOf(path);
  if (!address) return tl::unexpected(address.error());
  if (const Descriptor other(Connected(*address)); other.get() >= 0) {
    return Fail(fmt::format("{}: another trammel serve answers there", path.string()),
                ErrorKind::kMachine);
  }
  Descriptor listener(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  struct stat there {};
  if (lstat(path.c_str(), &there) == 0 && S_ISSOCK(there.st_mode)) unlink(path.c_str());
  const auto* const generic = reinterpret_cast<const sockaddr*>(&*address);
  // The mode before it listens, so that nobody else ever connects.
  if (listener.get() < 0 || bind(listener.get(), generic, sizeof *address) != 0 ||
      chmod(path.c_str(), S_IRUSR | S_IWUSR) != 0 ||
      listen(listener.get(), static_cast<int>(kMostClients)) != 0) {
    return Fail(
        fmt::format("{}: the socket cannot be made: {}", path.string(), std::strerror(errno)));
  }
  return std::unique_ptr<LocalSocket>(new LocalSocket(path, listener.Release(), std::move(answer)));
}

LocalSocket::LocalSocket(fs::path path, int listener, machine::RequestHandler answer)
    : path_(std::move(path)),
      listener_(listener),
      answer_(std::move(answer)),
      thread_([this](const std::stop_token& stop) { (void)NoteBug([&] { Serve(stop); }); }) {}

LocalSocket::~LocalSocket() {
  thread_.request_stop();
  thread_.join();
  unlink(path_.c_str());
  close(listener_);
}

void LocalSocket::Serve(const std::stop_token& stop) {
  std::list<Client> clients;
  double accepts_from_s = 0;
  while (!stop.stop_requested()) {
    const bool accepts = machine::HostNow() >= accepts_from_s;
    std::vector<pollfd> waiting = {{accepts ? listener_ : -1, POLLIN, 0}};
    for (const Client& client : clients) {
      const int events = client.outgoing.empty() ? POLLIN : POLLIN | POLLOUT;
      waiting.push_back({client.socket.get(), static_cast<short>(events), 0});
    }
    if (poll(waiting.data(), waiting.size(), kLook_ms) <= 0) continue;
    auto looked_at = waiting.begin() + 1;
    for (auto client = clients.begin(); client != clients.end(); ++looked_at) {
      const bool stays =
          looked_at->revents == 0 || ServeClient(*client, looked_at->revents, answer_);
      client = stays ? std::next(client) : clients.erase(client);
    }
    if (waiting.front().revents == 0) continue;
    if (clients.size() >= kMostClients) DropLongestSilent(clients);
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd >= 0) {
      clients.emplace_back(fd);
    } else if (errno != EINTR && errno != EAGAIN && errno != ECONNABORTED) {
      // No descriptor is left, which poll would report again at once.
      DropLongestSilent(clients);
      accepts_from_s = machine::HostNow() + kLook_ms / 1e3;
    }
  }
}

Result<json> AskLocally(const fs::path& path, const std::string& method, const json& params) {
  const auto nobody = [&](const std::string& why) {
    return Fail(fmt::format("no trammel serve answers at {}: {}; is it running on this computer, "
                            "as this user, for this printer?",
                            path.string(), why),
                ErrorKind::kMachine);
  };
  const auto address = AddressOf(path);
  if (!address) return tl::unexpected(address.error());
  Client server(Connected(*address));
  if (server.socket.get() < 0) return nobody(std::strerror(errno));
  server.outgoing =
      json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump(
          -1, ' ', false, json::error_handler_t::replace) +
      "\n";
  const double deadline_s = machine::HostNow() + kPatience_s;
  while (server.incoming.find('\n') == std::string::npos) {
    const short events = server.outgoing.empty() ? POLLIN : POLLOUT;
    if (machine::WaitForFd(server.socket.get(), events, deadline_s, {}) !=
        machine::Waited::kReady) {
      return nobody("it says nothing");
    }
    const bool alive = events == POLLOUT ? WriteSome(server) : ReadSome(server);
    if (!alive || server.incoming.size() > kLongestAnswer) return nobody("it hung up");
  }
  const auto answer = ParseBoundedJson(server.incoming, "the answer");
  if (!answer || !answer->is_object()) return nobody("its answer is none");
  if (const auto error = answer->find("error"); error != answer->end() && error->is_object()) {
    const json message = error->value("message", json());
    return Fail(message.is_string() ? message.get<std::string>() : "it was refused",
                ErrorKind::kMachine);
  }
  return answer->value("result", json());
}

}  // namespace trammel::service

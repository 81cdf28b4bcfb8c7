#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/bug_note.h"
#include "sim/camera/camera_http.h"
#include "sim/spindle/mill.h"

namespace trammel::sim {
namespace {

constexpr std::size_t kMostClients = 16;
constexpr std::size_t kLongestLine = 4096;

class Server final : public MillServer {
 public:
  explicit Server(std::shared_ptr<VirtualMill> mill) : mill_(std::move(mill)) {}
  ~Server() override {
    if (thread_.joinable()) {
      eventfd_write(wake_, 1);
      thread_.join();
    }
    for (const Client& client : clients_) close(client.fd);
    if (listener_ >= 0) close(listener_);
    if (wake_ >= 0) close(wake_);
  }
  int port() const override { return port_; }

  Result<void> Listen(int port) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    wake_ = eventfd(0, EFD_CLOEXEC);
    const int yes = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const plain = reinterpret_cast<sockaddr*>(&address);
    if (listener_ < 0 || wake_ < 0 || bind(listener_, plain, size) != 0 ||
        listen(listener_, kMostClients) != 0 || getsockname(listener_, plain, &size) != 0) {
      return Fail(fmt::format("the virtual mill cannot listen on 127.0.0.1:{}: {}; choose another "
                              "port or 0 for a free one",
                              port, std::strerror(errno)),
                  ErrorKind::kMachine);
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { (void)NoteBug([this] { Serve(); }); });
    return {};
  }

 private:
  struct Client {
    int fd = -1;
    std::string pending;
    bool gone = false;
  };

  void Serve() {
    for (;;) {
      std::vector<pollfd> wanted = {{wake_, POLLIN, 0}, {listener_, POLLIN, 0}};
      for (const Client& client : clients_) wanted.push_back({client.fd, POLLIN, 0});
      if (poll(wanted.data(), wanted.size(), -1) < 0) continue;
      if (wanted[0].revents != 0) return;
      for (std::size_t i = 0; i < clients_.size(); ++i) {
        if (wanted[i + 2].revents != 0) Talk(clients_[i]);
      }
      if (wanted[1].revents != 0) Accept();
      std::erase_if(clients_, [this](const Client& client) {
        if (!client.gone && mill_->serves()) return false;
        if (client.gone && mill_->serves()) mill_->Leave(MonotonicNow());
        close(client.fd);
        return true;
      });
    }
  }

  void Accept() {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) return;
    if (clients_.size() < kMostClients && mill_->serves()) {
      constexpr std::string_view kHello = "{\"id\": 0}\n";
      (void)send(fd, kHello.data(), kHello.size(), MSG_NOSIGNAL);
      clients_.push_back({fd, {}, false});
    } else {
      close(fd);
    }
  }

  void Talk(Client& client) {
    std::array<char, 1024> buffer{};
    const ssize_t count = recv(client.fd, buffer.data(), buffer.size(), 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    client.gone = count <= 0 || client.pending.size() > kLongestLine;
    if (client.gone) return;
    client.pending.append(buffer.data(), static_cast<std::size_t>(count));
    for (std::size_t end = client.pending.find('\n'); end != std::string::npos;
         end = client.pending.find('\n')) {
      std::string line = client.pending.substr(0, end);
      client.pending.erase(0, end + 1);
      while (!line.empty() && line.back() == '\r') line.pop_back();
      const std::string answer = mill_->Answer(line, MonotonicNow()) + '\n';
      if (!mill_->serves()) return;
      (void)send(client.fd, answer.data(), answer.size(), MSG_NOSIGNAL);
    }
  }

  std::shared_ptr<VirtualMill> mill_;
  int listener_ = -1;
  int wake_ = -1;
  int port_ = 0;
  std::vector<Client> clients_;  // the thread's own
  std::thread thread_;
};

}  // namespace

Result<void> JoinMill(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd < 0 || connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    if (fd >= 0) close(fd);
    return Fail(fmt::format("no virtual mill listens on 127.0.0.1:{}: {}; start trammel-sim mill",
                            port, std::strerror(error)),
                ErrorKind::kMachine);
  }
  std::array<pollfd, 2> wanted = {pollfd{STDIN_FILENO, POLLIN, 0}, pollfd{fd, POLLIN, 0}};
  for (bool open = true; open;) {
    if (poll(wanted.data(), wanted.size(), -1) < 0) continue;
    for (const pollfd& from : wanted) {
      if (from.revents == 0) continue;
      std::array<char, 4096> bytes{};
      const ssize_t count = read(from.fd, bytes.data(), bytes.size());
      const int to = from.fd == fd ? STDOUT_FILENO : fd;
      open = open && count > 0 && write(to, bytes.data(), static_cast<std::size_t>(count)) == count;
    }
  }
  close(fd);
  return {};
}

Result<std::unique_ptr<MillServer>> MillServer::Start(int port, std::shared_ptr<VirtualMill> mill) {
  auto server = std::make_unique<Server>(std::move(mill));
  TRY(server->Listen(port));
  return server;
}

}  // namespace trammel::sim

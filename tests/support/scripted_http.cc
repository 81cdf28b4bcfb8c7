#include "support/scripted_http.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <stdexcept>
#include <utility>

namespace trammel::test {
namespace {

int Bind(std::uint16_t& port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (fd < 0 || bind(fd, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no loopback socket");
  }
  port = ntohs(address.sin_port);
  return fd;
}

// Returns the body's length; 0 if it is not stated.
std::size_t BodyLength(std::string head) {
  std::transform(head.begin(), head.end(), head.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::string_view kField = "\r\ncontent-length:";
  const std::size_t at = head.find(kField);
  return at == std::string::npos ? 0 : std::strtoul(head.c_str() + at + kField.size(), nullptr, 10);
}

// A head with its body, or what came of it.
std::string ReadRequest(int fd) {
  std::string request;
  std::array<char, 4096> buffer{};
  std::size_t head = std::string::npos;
  while (head == std::string::npos ||
         request.size() < head + 4 + BodyLength(request.substr(0, head))) {
    const ssize_t count = recv(fd, buffer.data(), buffer.size(), 0);
    if (count <= 0) break;
    request.append(buffer.data(), static_cast<std::size_t>(count));
    head = request.find("\r\n\r\n");
  }
  return request;
}

}  // namespace

bool HttpPeer::Send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

void HttpPeer::WaitForClose() {
  // Read the remaining input: closing over it would reset the connection, and lose the answer.
  std::array<char, 4096> buffer{};
  pollfd wanted{fd_, POLLIN, 0};
  while (poll(&wanted, 1, 10'000) > 0 && recv(fd_, buffer.data(), buffer.size(), 0) > 0) {
  }
}

ScriptedHttp::ScriptedHttp(Script script)
    : script_(std::move(script)), listener_(Bind(port_)), wake_(eventfd(0, EFD_CLOEXEC)) {
  if (listen(listener_, 8) != 0) throw std::runtime_error("no listening socket");
  thread_ = std::thread([this] { Serve(); });
}

ScriptedHttp::~ScriptedHttp() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = write(wake_, &one, sizeof one);
  thread_.join();
  close(listener_);
  close(wake_);
}

void ScriptedHttp::Serve() {
  for (;;) {
    std::array<pollfd, 2> wanted{pollfd{listener_, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    poll(wanted.data(), wanted.size(), -1);
    if (wanted[1].revents != 0) return;
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (fd < 0) continue;
    const std::string request = ReadRequest(fd);
    {
      const std::lock_guard lock(mutex_);
      requests_.push_back(request);
    }
    HttpPeer peer(fd);
    script_(request, peer);
    close(fd);
  }
}

std::string ScriptedHttp::Url(const std::string& path) const {
  return "http://127.0.0.1:" + std::to_string(port_) + path;
}

std::vector<std::string> ScriptedHttp::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

std::uint16_t UnusedPort() {
  std::uint16_t port = 0;
  close(Bind(port));
  return port;
}

std::string MjpegHead(const std::string& boundary) {
  return "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=" + boundary +
         "\r\n\r\n";
}

std::string MjpegPart(const std::string& jpeg, const std::string& fields,
                      const std::string& boundary) {
  return "--" + boundary +
         "\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size()) + "\r\n" +
         fields + "\r\n" + jpeg + "\r\n";
}

}  // namespace trammel::test

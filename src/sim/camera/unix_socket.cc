#include "sim/camera/unix_socket.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <system_error>
#include <utility>

namespace trammel::sim {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kLongestPath = 100;  // bytes; the system takes a few more
constexpr std::size_t kChunk = 1 << 20;
constexpr int kBacklog = 8;

std::string SystemSaid() { return std::system_category().message(errno); }

tl::unexpected<Error> FailMachine(std::string message) {
  return Fail(std::move(message), ErrorKind::kMachine);
}

class Deadline {
 public:
  explicit Deadline(double limit_s)
      : limit_s_(limit_s),
        end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                std::chrono::duration<double>(endless() ? 0 : limit_s))) {}

  [[nodiscard]] double limit_s() const { return limit_s_; }
  /// As poll() takes it.
  [[nodiscard]] int LeftMs() const {
    if (endless()) return -1;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end_ - Clock::now());
    return static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 1'000'000));
  }

 private:
  [[nodiscard]] bool endless() const { return !std::isfinite(limit_s_); }

  double limit_s_;
  Clock::time_point end_;
};

Result<void> Wait(int descriptor, short events, const Deadline& deadline) {
  pollfd waited{descriptor, events, 0};
  int ready = 0;
  do {
    ready = poll(&waited, 1, deadline.LeftMs());
  } while (ready < 0 && errno == EINTR);
  if (ready < 0) return FailMachine(SystemSaid());
  if (ready == 0) {
    return FailMachine(fmt::format("nothing came or went for {:g} s", deadline.limit_s()));
  }
  return {};
}

// Whether a call on the socket is to be made again, once it is ready.
bool Again() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

Result<void> SendAll(int descriptor, std::string_view bytes, const Deadline& deadline) {
  while (!bytes.empty()) {
    const ssize_t sent = send(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    } else if (!Again()) {
      return FailMachine(SystemSaid());
    } else if (const Result<void> ready = Wait(descriptor, POLLOUT, deadline); !ready) {
      return ready;
    }
  }
  return {};
}

Result<void> ReceiveAll(int descriptor, char* to, std::size_t size, const Deadline& deadline) {
  while (size > 0) {
    const ssize_t got = recv(descriptor, to, size, MSG_DONTWAIT);
    if (got == 0) return FailMachine("the other side has closed the connection");
    if (got > 0) {
      to += got;
      size -= static_cast<std::size_t>(got);
    } else if (!Again()) {
      return FailMachine(SystemSaid());
    } else if (const Result<void> ready = Wait(descriptor, POLLIN, deadline); !ready) {
      return ready;
    }
  }
  return {};
}

struct Opened {
  UnixSocket socket;
  int descriptor;
  sockaddr_un address;
};

Result<Opened> Open(const std::filesystem::path& path) {
  const std::string& name = path.native();
  if (name.empty() || name.size() > kLongestPath || name.find('\0') != std::string::npos) {
    return Fail(fmt::format("a socket's path has 1 to {} bytes, not {}; choose another one",
                            kLongestPath, name.size()));
  }
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, name.data(), name.size());
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return FailMachine(SystemSaid());
  return Opened{UnixSocket(descriptor), descriptor, address};
}

const sockaddr* Generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

// A server that was killed leaves its socket's file behind; the system refuses connections to it.
void RemoveIfAbandoned(const sockaddr_un& address) {
  struct stat status {};
  if (lstat(address.sun_path, &status) != 0 || !S_ISSOCK(status.st_mode)) return;
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (probe < 0) return;
  const UnixSocket owner(probe);
  const bool answers = connect(probe, Generic(address), sizeof(address)) == 0;
  if (!answers && errno == ECONNREFUSED) unlink(address.sun_path);
}

}  // namespace

UnixSocket::UnixSocket(UnixSocket&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

UnixSocket& UnixSocket::operator=(UnixSocket&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

UnixSocket::~UnixSocket() {
  if (descriptor_ >= 0) close(descriptor_);
}

Result<UnixSocket> UnixSocket::Listen(const std::filesystem::path& path) {
  Opened opened = TRY(Open(path));
  const auto& [socket, descriptor, address] = opened;
  RemoveIfAbandoned(address);
  if (bind(descriptor, Generic(address), sizeof(address)) != 0) return FailMachine(SystemSaid());
  // Before it listens, so that nobody else ever connects.
  if (chmod(path.c_str(), S_IRUSR | S_IWUSR) != 0 || listen(descriptor, kBacklog) != 0) {
    const std::string said = SystemSaid();
    unlink(path.c_str());
    return FailMachine(said);
  }
  return std::move(opened.socket);
}

Result<UnixSocket> UnixSocket::Connect(const std::filesystem::path& path) {
  Opened opened = TRY(Open(path));
  const sockaddr_un& address = opened.address;
  if (connect(opened.descriptor, Generic(address), sizeof(address)) != 0) {
    return FailMachine(SystemSaid());
  }
  return std::move(opened.socket);
}

Result<UnixSocket> UnixSocket::Accept() const {
  for (;;) {
    const int client = accept4(descriptor_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client >= 0) return UnixSocket(client);
    if (errno != EINTR && errno != ECONNABORTED) return FailMachine(SystemSaid());
  }
}

Result<void> UnixSocket::Send(std::string_view message, double limit_s) const {
  const Deadline deadline(limit_s);
  const auto size = static_cast<std::uint32_t>(message.size());
  if (size != message.size()) return FailMachine(fmt::format("{} bytes to send", message.size()));
  char head[sizeof(size)];
  std::memcpy(head, &size, sizeof(size));
  const Result<void> sent = SendAll(descriptor_, {head, sizeof(head)}, deadline);
  return sent ? SendAll(descriptor_, message, deadline) : sent;
}

Result<std::string> UnixSocket::Receive(std::size_t longest, double limit_s) const {
  const Deadline deadline(limit_s);
  std::uint32_t size = 0;
  char head[sizeof(size)];
  TRY(ReceiveAll(descriptor_, head, sizeof(head), deadline));
  std::memcpy(&size, head, sizeof(size));
  if (size > longest) {
    return FailMachine(fmt::format("a message of {} bytes where {} are the most", size, longest));
  }
  std::string message;
  while (message.size() < size) {
    const std::size_t before = message.size();
    message.resize(std::min<std::size_t>(size, before + kChunk));
    TRY(ReceiveAll(descriptor_, message.data() + before, message.size() - before, deadline));
  }
  return message;
}

bool UnixSocket::ended() const {
  pollfd asked{descriptor_, POLLRDHUP, 0};
  return poll(&asked, 1, 0) > 0;
}

void UnixSocket::Shutdown() const { shutdown(descriptor_, SHUT_RDWR); }

}  // namespace trammel::sim

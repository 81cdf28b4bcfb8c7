#include "machine/net/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <thread>

#include "machine/net/host_clock.h"
#include "machine/net/wait.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 24U;  // per message; a scan is split

struct Head {
  std::uint32_t kind;
  std::uint32_t size;
};

bool SendAll(int fd, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    const ssize_t written = write(fd, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

[[noreturn]] void RunChild(const std::function<void(const ChildSender&)>& work, int fd,
                           pid_t parent) {
  // Ends with a killed parent, which may be gone before this call.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(1);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGTERM, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  try {
    work(ChildSender(fd));
  } catch (...) {
    _exit(1);  // nothing above to catch it: the frames of the parent are none of this process's
  }
  _exit(0);
}

}  // namespace

bool ChildSender::Send(std::uint32_t kind, std::span<const std::uint8_t> bytes) const {
  const Head head{kind, static_cast<std::uint32_t>(bytes.size())};
  return SendAll(fd_, &head, sizeof head) && SendAll(fd_, bytes.data(), bytes.size());
}

bool ChildSender::Send(std::uint32_t kind, std::string_view text) const {
  return Send(kind, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

Result<ChildProcess> ChildProcess::Start(const std::function<void(const ChildSender&)>& work,
                                         double patience_s) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return Fail(fmt::format("no pipe to another process: {}", std::strerror(errno)),
                ErrorKind::kMachine);
  }
  const pid_t parent = getpid();
  const pid_t process = fork();
  if (process == 0) {
    close(ends[0]);
    RunChild(work, ends[1], parent);
  }
  close(ends[1]);
  if (process < 0) {
    close(ends[0]);
    return Fail(fmt::format("no other process can be started: {}", std::strerror(errno)),
                ErrorKind::kMachine);
  }
  return ChildProcess(process, ends[0], patience_s);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : process_(other.process_),
      fd_(other.fd_),
      patience_s_(other.patience_s_),
      status_(other.status_) {
  other.process_ = -1;
  other.fd_ = -1;
}

ChildProcess::~ChildProcess() {
  // Closed first: a child that still writes gets an error.
  if (fd_ >= 0) close(fd_);
  static_cast<void>(End());
}

Received ChildProcess::ReceiveBytes(std::span<std::uint8_t> bytes, double silence_s,
                                    const std::stop_token& stop) const {
  while (!bytes.empty()) {
    switch (WaitForFd(fd_, POLLIN, HostNow() + silence_s, stop)) {
      case Waited::kStopped:
        return Received::kStopped;
      case Waited::kTimeLimit:
        return Received::kSilence;
      case Waited::kReady:
        break;
    }
    const ssize_t count = read(fd_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Received::kEnded;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return Received::kMessage;
}

Received ChildProcess::Receive(ChildMessage& message, double silence_s,
                               const std::stop_token& stop) {
  std::array<std::uint8_t, sizeof(Head)> bytes{};
  if (const Received heard = ReceiveBytes(bytes, silence_s, stop); heard != Received::kMessage) {
    return heard;
  }
  Head head{};
  std::memcpy(&head, bytes.data(), sizeof head);
  if (head.size > kMaxBytes) return Received::kEnded;
  message.kind = head.kind;
  message.bytes.resize(head.size);
  return ReceiveBytes(message.bytes, silence_s, stop);
}

bool ChildProcess::WaitForEnd() {
  constexpr auto kLook = std::chrono::milliseconds(5);
  const double deadline_s = HostNow() + patience_s_;
  for (;;) {
    const pid_t ended = waitpid(process_, &status_, WNOHANG);
    if (ended == process_ || (ended < 0 && errno != EINTR)) {
      process_ = -1;
      return true;
    }
    if (HostNow() >= deadline_s) return false;
    std::this_thread::sleep_for(kLook);
  }
}

std::string ChildProcess::End() {
  if (process_ > 0) kill(process_, SIGTERM);
  if (process_ > 0 && !WaitForEnd()) {
    kill(process_, SIGKILL);
    waitpid(process_, &status_, 0);
    process_ = -1;
  }
  if (WIFSIGNALED(status_)) {
    return fmt::format("signal {}, {}", WTERMSIG(status_), strsignal(WTERMSIG(status_)));
  }
  return fmt::format("exit code {}", WEXITSTATUS(status_));
}

void LimitThisProcess(std::uint64_t bytes, int seconds) {
  const auto max_s = static_cast<rlim_t>(seconds);
  const rlimit time{max_s, max_s + 1};
  setrlimit(RLIMIT_CPU, &time);
#ifndef TRAMMEL_SANITIZED
  unsigned long long pages = 0;
  std::FILE* const own = std::fopen("/proc/self/statm", "r");
  const bool known = own != nullptr && std::fscanf(own, "%llu", &pages) == 1;
  if (own != nullptr) std::fclose(own);
  if (!known) return;
  const rlim_t most = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + bytes;
  rlimit addresses{};
  getrlimit(RLIMIT_AS, &addresses);
  addresses.rlim_cur = std::min(addresses.rlim_cur, most);
  setrlimit(RLIMIT_AS, &addresses);
#else
  static_cast<void>(bytes);
#endif
}

}  // namespace trammel::machine

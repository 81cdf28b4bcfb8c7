#include "machine/net/dialogue_process.h"

#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "machine/net/host_clock.h"
#include "machine/net/wait.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kLongestLine = 65536;
constexpr double kPatience_s = 30;

tl::unexpected<Error> Broken(const std::string& what) { return Fail(what, ErrorKind::kMachine); }

// Starts a program with one end of a connection as its standard input and output; returns an errno
// on failure.
int Spawn(std::vector<std::string> words, int end, pid_t& process) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, end, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, end, STDOUT_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t signals;
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&attributes, &signals);
  sigfillset(&signals);
  posix_spawnattr_setsigdefault(&attributes, &signals);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  const int failed =
      posix_spawnp(&process, arguments.front(), &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  return failed;
}

}  // namespace

Result<std::unique_ptr<DialogueProcess>> DialogueProcess::Start(
    const std::vector<std::string>& words) {
  // A socket, since a write to a child that has ended must not end this process.
  std::array<int, 2> ends{-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return Broken(
        fmt::format("{}: no line to another process: {}", words.front(), std::strerror(errno)));
  }
  pid_t process = -1;
  const int failed = Spawn(words, ends[1], process);
  close(ends[1]);
  if (failed != 0) {
    close(ends[0]);
    return Broken(fmt::format("{} cannot be started: {}", words.front(), std::strerror(failed)));
  }
  return std::unique_ptr<DialogueProcess>(new DialogueProcess(process, ends[0]));
}

DialogueProcess::~DialogueProcess() {
  shutdown(fd_, SHUT_RDWR);  // a child that still writes is not waited for
  const double end_s = HostNow() + kPatience_s;
  constexpr double kLook_s = 0.01;
  bool ended = false;
  while (!(ended = waitpid(process_, nullptr, WNOHANG) != 0) && HostNow() < end_s) {
    (void)WaitForFd(-1, 0, HostNow() + kLook_s, {});
  }
  if (!ended) {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  close(fd_);
}

Result<std::string> DialogueProcess::Ask(std::string_view line, double time_limit_s,
                                         const std::stop_token& stop) {
  std::string text(line);
  text += '\n';
  const double deadline_s = HostNow() + time_limit_s;
  for (std::string_view left = text; !left.empty();) {
    const Waited waited = WaitForFd(fd_, POLLOUT, deadline_s, stop);
    if (waited == Waited::kStopped) return Fail("stopped", ErrorKind::kInterrupted);
    if (waited == Waited::kTimeLimit)
      return Broken(fmt::format("it takes nothing within {} s", time_limit_s));
    const ssize_t sent = send(fd_, left.data(), left.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (sent <= 0) return Broken("it has ended");
    left.remove_prefix(static_cast<std::size_t>(sent));
  }
  return ReadLine(time_limit_s, stop);
}

Result<std::string> DialogueProcess::ReadLine(double time_limit_s, const std::stop_token& stop) {
  const double deadline_s = HostNow() + time_limit_s;
  for (;;) {
    if (const std::size_t end = partial_.find('\n'); end != std::string::npos) {
      std::string line = partial_.substr(0, end);
      partial_.erase(0, end + 1);
      return line;
    }
    if (partial_.size() > kLongestLine)
      return Broken(fmt::format("it says more than {} bytes", kLongestLine));
    const Waited waited = WaitForFd(fd_, POLLIN, deadline_s, stop);
    if (waited == Waited::kStopped) return Fail("stopped", ErrorKind::kInterrupted);
    if (waited == Waited::kTimeLimit)
      return Broken(fmt::format("it does not answer within {} s", time_limit_s));
    std::array<char, 4096> bytes{};
    const ssize_t count = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count <= 0) return Broken("it has ended");
    partial_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace trammel::machine

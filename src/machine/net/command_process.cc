#include "machine/net/command_process.h"

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
#include <csignal>
#include <cstring>
#include <utility>

#include "machine/net/host_clock.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr int kLook_ms = 200;  // poll interval for an ended child whose pipes others hold

using Ends = std::array<int, 2>;

void CloseBoth(const Ends& ends) {
  for (const int fd : ends) {
    if (fd >= 0) close(fd);
  }
}

// Closes inherited descriptors, so that no lost agent's connection survives in the child.
void CloseAllOthers() {
  if (close_range(STDERR_FILENO + 1, ~0U, 0) == 0) return;
  constexpr int kMax = 65536;
  const long most = sysconf(_SC_OPEN_MAX);
  for (int fd = STDERR_FILENO + 1; fd < (most > 0 && most < kMax ? most : kMax); ++fd) close(fd);
}

// Only async-signal-safe calls after the fork, as other threads may have held any lock.
[[noreturn]] void Become(char* const* words, int input, int output, int error, pid_t parent,
                         const rlimit& file_bytes) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(1);
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(error, STDERR_FILENO);
  CloseAllOthers();
  for (int number = 1; number < NSIG; ++number) std::signal(number, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  if (file_bytes.rlim_cur != RLIM_INFINITY) setrlimit(RLIMIT_FSIZE, &file_bytes);
  execv(words[0], words);
  constexpr std::string_view kFailed = "trammel: the program cannot be started again\n";
  (void)!write(STDERR_FILENO, kFailed.data(), kFailed.size());
  _exit(127);
}

}  // namespace

std::string CommandEnd::Describe() const {
  if (signal != 0) return fmt::format("signal {}, {}", signal, strsignal(signal));
  return fmt::format("exit code {}", exit_code);
}

Result<std::unique_ptr<CommandProcess>> CommandProcess::Start(
    const std::vector<std::string>& words, std::optional<std::uint64_t> max_file_bytes) {
  const rlim_t most = max_file_bytes.value_or(RLIM_INFINITY);
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  Ends output{-1, -1};
  Ends error{-1, -1};
  const int input = open("/dev/null", O_RDONLY | O_CLOEXEC);
  const auto fail = [&](const char* what) {
    const int why = errno;
    CloseBoth(output);
    CloseBoth(error);
    if (input >= 0) close(input);
    return Fail(fmt::format("{}: {}: {}", words.front(), what, std::strerror(why)),
                ErrorKind::kMachine);
  };
  if (input < 0 || pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(error.data(), O_CLOEXEC) != 0) {
    return fail("no pipe to another process");
  }
  const pid_t parent = getpid();
  const pid_t process = fork();
  if (process == 0) Become(arguments.data(), input, output[1], error[1], parent, {most, most});
  if (process < 0) return fail("no other process can be started");
  close(input);
  close(output[1]);
  close(error[1]);
  return std::unique_ptr<CommandProcess>(new CommandProcess(process, output[0], error[0]));
}

CommandProcess::CommandProcess(pid_t process, int output, int error) : process_(process) {
  output_.fd = output;
  error_.fd = error;
}

CommandProcess::~CommandProcess() {
  AskToEnd();
  Wait();
  CloseBoth({output_.fd, error_.fd});
}

bool CommandProcess::Read(OutputStream stream, const TakeLine& take) {
  Pipe& pipe = stream == OutputStream::kOutput ? output_ : error_;
  std::array<char, kLongestLine> bytes{};
  const ssize_t count = read(pipe.fd, bytes.data(), bytes.size());
  if (count < 0 && errno == EINTR) return true;
  if (count <= 0) {
    if (!pipe.cut && !pipe.line.empty()) take(stream, pipe.line);
    pipe.line.clear();
    close(std::exchange(pipe.fd, -1));
    return false;
  }
  for (const char c : std::string_view(bytes.data(), static_cast<std::size_t>(count))) {
    if (c == '\n' || c == '\r') {
      if (!pipe.cut && (c == '\n' || !pipe.line.empty())) take(stream, pipe.line);
      pipe.line.clear();
      pipe.cut = false;
    } else if (!pipe.cut) {
      pipe.line += c;
      if (pipe.line.size() < kLongestLine) continue;
      take(stream, pipe.line);
      pipe.cut = true;
    }
  }
  return true;
}

CommandEnd CommandProcess::Follow(const TakeLine& take, const CommandLimits& limits) {
  using enum CommandEnd::Cause;
  CommandEnd end;
  double deadline_s = HostNow() + limits.silence_s;
  while (output_.fd >= 0 || error_.fd >= 0) {
    const bool stop = limits.stop.stop_requested();
    if (end.cause == kItself && (stop || HostNow() > deadline_s)) {
      end.cause = stop ? kStop : kSilence;
      deadline_s = HostNow() + limits.rest_s;
      AskToEnd();
    } else if (end.cause != kItself && HostNow() > deadline_s) {
      Signal(SIGKILL);
    }
    std::array<pollfd, 2> waiting{{{output_.fd, POLLIN, 0}, {error_.fd, POLLIN, 0}}};
    const int ready = poll(waiting.data(), waiting.size(), kLook_ms);
    if (ready < 0 && errno != EINTR) break;
    // Reads its last output before it counts as ended.
    if (ready == 0 && HasEnded()) break;
    if (ready <= 0) continue;
    if (end.cause == kItself) deadline_s = HostNow() + limits.silence_s;
    if (waiting[0].revents != 0) (void)Read(OutputStream::kOutput, take);
    if (waiting[1].revents != 0) (void)Read(OutputStream::kError, take);
  }
  Wait();
  const std::lock_guard lock(mutex_);
  if (WIFSIGNALED(status_)) {
    end.signal = WTERMSIG(status_);
  } else {
    end.exit_code = WEXITSTATUS(status_);
  }
  return end;
}

bool CommandProcess::HasEnded() {
  const std::lock_guard lock(mutex_);
  if (!ended_) {
    const pid_t waited = waitpid(process_, &status_, WNOHANG);
    ended_ = waited == process_ || (waited < 0 && errno != EINTR);
  }
  return ended_;
}

void CommandProcess::Wait() {
  constexpr int kAgain_ms = 5;
  while (!HasEnded()) poll(nullptr, 0, kAgain_ms);
}

void CommandProcess::AskToEnd() { Signal(SIGTERM); }

void CommandProcess::Signal(int number) {
  const std::lock_guard lock(mutex_);
  if (!ended_) kill(process_, number);
}

}  // namespace trammel::machine

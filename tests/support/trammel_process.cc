#include "support/trammel_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <string>

#include "support/sanitized.h"

namespace trammel::test {
namespace {

constexpr useconds_t kLook_us = 10'000;

double Now() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// Between fork and exec: nothing here may take memory or a lock.
[[noreturn]] void Become(char* const* arguments, char* const* environment, const char* folder,
                         const char* output, const char* errors, const char* terminal,
                         const ProcessLimits& limits, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent || chdir(folder) != 0) _exit(127);
  if (terminal != nullptr) {
    setsid();
    dup2(open(terminal, O_RDWR), STDIN_FILENO);
  } else {
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  }
  int nobody[2];
  if (limits.nobody_reads && pipe(nobody) == 0) {
    close(nobody[0]);
    dup2(nobody[1], STDOUT_FILENO);
    dup2(nobody[1], STDERR_FILENO);
  } else {
    dup2(open(output, O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    dup2(terminal != nullptr ? STDIN_FILENO : open(errors, O_WRONLY | O_CREAT | O_TRUNC, 0600),
         STDERR_FILENO);
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  if (limits.file_bytes > 0) {
    const rlimit limit{limits.file_bytes, limits.file_bytes};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  if (limits.open_files > 0) {
    const rlimit limit{limits.open_files, limits.open_files};
    setrlimit(RLIMIT_NOFILE, &limit);
  }
  execve(arguments[0], arguments, environment);
  _exit(127);
}

// This process's environment, with a state folder that other processes of the same folder share.
std::vector<std::string> EnvironmentFor(const std::filesystem::path& folder) {
  const std::string state = "XDG_STATE_HOME=";
  std::vector<std::string> environment = {state + (folder / "state").string()};
  for (char** at = environ; *at != nullptr; ++at) {
    if (std::string(*at).rfind(state, 0) != 0) environment.emplace_back(*at);
  }
  return environment;
}

std::vector<char*> Pointers(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

std::vector<std::string> WordsOf(const std::string& arguments) {
  std::istringstream text(arguments);
  std::vector<std::string> words;
  for (std::string word; text >> std::quoted(word, '\'');) words.push_back(word);
  return words;
}

}  // namespace

TrammelProcess::TrammelProcess(const std::string& arguments, const std::filesystem::path& folder)
    : TrammelProcess(WordsOf(arguments), folder) {}

TrammelProcess::TrammelProcess(const std::vector<std::string>& arguments,
                               const std::filesystem::path& folder, const ProcessLimits& limits)
    : began_s_(Now()) {
  const bool sim = !arguments.empty() && arguments.front() == "sim";
  std::vector<std::string> words = {sim ? TRAMMEL_SIM_BINARY : TRAMMEL_BINARY};
  words.insert(words.end(), arguments.begin() + (sim ? 1 : 0), arguments.end());
  std::vector<std::string> settings = EnvironmentFor(folder);
  const std::vector<char*> pointers = Pointers(words);
  const std::vector<char*> environment = Pointers(settings);
  const std::string output = (aside_.path() / "stdout").string();
  const std::string errors = (aside_.path() / "stderr").string();
  const char* terminal = nullptr;
  if (limits.terminal) {
    terminal_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (terminal_ >= 0 && grantpt(terminal_) == 0 && unlockpt(terminal_) == 0) {
      terminal = ptsname(terminal_);
    }
    if (terminal == nullptr) throw std::runtime_error("there is no terminal to be had");
    std::ofstream(errors, std::ios::binary);
  }
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("no process could be started");
  if (pid_ == 0) {
    Become(pointers.data(), environment.data(), folder.c_str(), output.c_str(), errors.c_str(),
           terminal, limits, parent);
  }
}

TrammelProcess::~TrammelProcess() {
  HangUp();
  if (ended_) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void TrammelProcess::Limit(int resource, std::uint64_t value) const {
  rlimit limit{};
  const auto which = static_cast<__rlimit_resource>(resource);
  if (prlimit(pid_, which, nullptr, &limit) == 0) {
    limit.rlim_cur = value;
    if (prlimit(pid_, which, &limit, nullptr) == 0) return;
  }
  throw std::runtime_error(std::string("cannot set a limit of trammel: ") + std::strerror(errno));
}

void TrammelProcess::Type(const std::string& line) const {
  const std::string typed = line + "\n";
  if (write(terminal_, typed.data(), typed.size()) != static_cast<ssize_t>(typed.size())) {
    throw std::runtime_error("nothing can be typed at trammel's terminal");
  }
}

void TrammelProcess::HangUp() {
  if (terminal_ < 0) return;
  TakeTerminal();
  close(terminal_);
  terminal_ = -1;
}

void TrammelProcess::TakeTerminal() const {
  if (terminal_ < 0) return;
  std::ofstream errors(aside_.path() / "stderr", std::ios::binary | std::ios::app);
  char bytes[4096];
  for (ssize_t count = 0; (count = read(terminal_, bytes, sizeof bytes)) > 0;) {
    errors.write(bytes, count);
  }
}

void TrammelProcess::Send(int signal) const {
  if (!ended_) kill(pid_, signal);
}

// The kernel's own record of a child's largest size counts what it inherited from this process
// before it became trammel; its status file does not.
void TrammelProcess::LookAtMemory() {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  for (std::string word; status >> word;) {
    double kib = 0;
    if (word == "VmHWM:" && status >> kib) end_.peak_memory_mb = kib * 1024 / 1e6;
  }
}

bool TrammelProcess::Running() {
  if (ended_) return false;
  TakeTerminal();
  LookAtMemory();
  int status = 0;
  rusage usage{};
  if (wait4(pid_, &status, WNOHANG, &usage) != pid_) return true;
  ended_ = true;
  end_.elapsed_s = Now() - began_s_;
  end_.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  if (WIFEXITED(status)) end_.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) end_.signal = WTERMSIG(status);
  return false;
}

std::string TrammelProcess::StandardErrorSoFar() const {
  TakeTerminal();
  return ReadWhole(aside_.path() / "stderr");
}

std::string TrammelProcess::WaitForLine(const std::string& label) {
  const double until_s = Now() + kSanitizerSlowdown * kEnough_s;
  for (bool running = true; running && Now() < until_s; usleep(kLook_us)) {
    running = Running();
    const std::string text = "\n" + ReadWhole(aside_.path() / "stdout");
    const std::size_t begin = text.find("\n" + label);
    const std::size_t end = begin == std::string::npos ? begin : text.find('\n', begin + 1);
    if (end == std::string::npos) continue;
    return text.substr(begin + 1 + label.size(), end - begin - 1 - label.size());
  }
  return "";
}

ProcessEnd TrammelProcess::Wait(double time_limit_s) {
  const double until_s = Now() + kSanitizerSlowdown * time_limit_s;
  while (Running()) {
    if (Now() > until_s && !end_.timed_out) {
      end_.timed_out = true;
      Send(SIGKILL);
    }
    usleep(kLook_us);
  }
  end_.standard_output = ReadWhole(aside_.path() / "stdout");
  end_.standard_error = StandardErrorSoFar();
  end_.output = end_.standard_output + end_.standard_error;
  return end_;
}

}  // namespace trammel::test

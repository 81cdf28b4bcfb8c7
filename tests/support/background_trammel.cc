#include "support/background_trammel.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <stdexcept>
#include <thread>

namespace trammel::test {
namespace {

constexpr auto kPatience = std::chrono::seconds(30);  // with a loaded host

// Whether it becomes true in time.
bool Becomes(const std::function<bool()>& condition) {
  const auto begin = std::chrono::steady_clock::now();
  while (!condition()) {
    if (std::chrono::steady_clock::now() - begin > kPatience) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

}  // namespace

BackgroundTrammel::BackgroundTrammel(const std::string& arguments,
                                     const std::filesystem::path& folder) {
  const std::string files = aside_.path().string();
  std::string command = "cd '" + folder.string() + "' && export XDG_STATE_HOME='" +
                        (folder / "state").string() + "' && exec '" TRAMMEL_BINARY "' " +
                        arguments + " >'" + files + "/stdout' 2>'" + files + "/stderr' </dev/null";
  std::string shell = "/bin/sh";
  std::string flag = "-c";
  char* const words[] = {shell.data(), flag.data(), command.data(), nullptr};
  if (posix_spawn(&process_, shell.c_str(), nullptr, nullptr, words, environ) != 0) {
    throw std::runtime_error("no shell to run: " + command);
  }
}

BackgroundTrammel::~BackgroundTrammel() {
  if (Ended()) return;
  Signal(SIGKILL);
  waitpid(process_, &status_, 0);
}

bool BackgroundTrammel::Ended() {
  if (!ended_) ended_ = waitpid(process_, &status_, WNOHANG) == process_;
  return ended_;
}

std::string BackgroundTrammel::WaitForLine(const std::string& label) {
  std::string found;
  (void)Becomes([&] {
    const bool ended = Ended();
    const std::string text = "\n" + ReadWhole(aside_.path() / "stdout");
    const std::size_t begin = text.find("\n" + label);
    const std::size_t end = begin == std::string::npos ? begin : text.find('\n', begin + 1);
    if (end == std::string::npos) return ended;
    found = text.substr(begin + 1 + label.size(), end - begin - 1 - label.size());
    return true;
  });
  return found;
}

void BackgroundTrammel::Signal(int number) const {
  if (!ended_) kill(process_, number);
}

int BackgroundTrammel::WaitForEnd() {
  if (!Becomes([this] { return Ended(); })) return -2;
  return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
}

std::string BackgroundTrammel::standard_error() const {
  return ReadWhole(aside_.path() / "stderr");
}

}  // namespace trammel::test

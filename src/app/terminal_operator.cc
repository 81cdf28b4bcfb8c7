#include "app/terminal_operator.h"

#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <thread>
#include <utility>

#include "app/option_values.h"

namespace trammel::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{200};
constexpr std::size_t kLongestLine = 4096;

tl::unexpected<Error> Stopped() {
  return tl::unexpected(Error{ErrorKind::kInterrupted, "stopped while it waited for an answer"});
}

std::optional<bool> YesOrNo(std::string_view text) {
  std::string word(WithoutSpaces(text));
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (word == "y" || word == "yes") return true;
  if (word.empty() || word == "n" || word == "no") return false;
  return std::nullopt;
}

}  // namespace

TerminalOperator::TerminalOperator(std::stop_token stop, std::set<std::string> yes)
    : stop_(std::move(stop)),
      yes_(std::move(yes)),
      present_(isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0) {}

bool TerminalOperator::AnsweredBefore(const std::string& name) const { return yes_.contains(name); }

Result<void> TerminalOperator::CheckCanAnswer(const std::string& name) const {
  if (present_ || AnsweredBefore(name)) return {};
  return Fail(
      fmt::format("there is no terminal to ask at, and \"{0}\" has to be answered: run it in "
                  "a terminal, or say --yes {0}",
                  name));
}

// Returns a line typed so far; absent if there is none.
Result<std::optional<std::string>> TerminalOperator::TakeLine() {
  for (;;) {
    const std::size_t end = typed_.find('\n');
    if (end != std::string::npos) {
      std::string line = typed_.substr(0, end);
      typed_.erase(0, end + 1);
      return std::optional(std::move(line));
    }
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, 0) <= 0) return std::optional<std::string>();
    std::array<char, 512> bytes{};
    const ssize_t count = read(STDIN_FILENO, bytes.data(), bytes.size());
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) return std::optional<std::string>();
    if (count <= 0) {
      return tl::unexpected(Error{ErrorKind::kInterrupted, "nobody is at the terminal any more"});
    }
    typed_.append(bytes.data(), static_cast<std::size_t>(count));
    if (typed_.size() > kLongestLine) typed_.clear();  // no answer, and no path
  }
}

Result<bool> TerminalOperator::Confirm(const procedure::Question& question,
                                       const std::function<Result<void>()>& meanwhile) {
  if (AnsweredBefore(question.name)) {
    fmt::print(stderr, "{}: yes, by --yes {}\n", question.text, question.name);
    return true;
  }
  TRY(CheckCanAnswer(question.name));
  typed_.clear();
  tcflush(STDIN_FILENO, TCIFLUSH);
  fmt::print(stderr, "{}? [y/N] ", question.text);
  std::fflush(stderr);
  auto looked = Clock::now();
  for (;;) {
    if (stop_.stop_requested()) return Stopped();
    const auto line = TRY(TakeLine());
    if (line) {
      if (const auto answer = YesOrNo(*line)) return *answer;
      fmt::print(stderr, "y or n? [y/N] ");
      std::fflush(stderr);
    }
    if (meanwhile && Clock::now() - looked >= std::chrono::seconds(1)) {
      looked = Clock::now();
      if (auto well = meanwhile(); !well) {
        fmt::print(stderr, "\n");
        return tl::unexpected(well.error());
      }
    }
    std::this_thread::sleep_for(kLook);
  }
}

Result<std::optional<std::string>> TerminalOperator::LineWithin(double time_s) {
  const auto until = Clock::now() + std::chrono::duration<double>(time_s);
  for (;;) {
    if (stop_.stop_requested()) return Stopped();
    if (present_) {
      auto line = TakeLine();
      if (!line || *line) return line;
    }
    if (Clock::now() >= until) return std::optional<std::string>();
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace trammel::app

#include "app/console.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "base/utf8.h"

namespace trammel::app {
namespace {

constexpr std::size_t kMaxKept = 1'000'000;
// Number of bytes that a pipe reported as writable accepts without blocking.
constexpr std::size_t kPiece = 512;
constexpr int kLook_ms = 100;
constexpr std::string_view kErrorBegins = "trammel: ";  // as in app/commands.h

std::atomic<bool> asked_to_end = false;

// True if a signal has arrived, or is pending while held back (app/interrupt.h): nothing may wait
// for a reader then.
bool AskedToEnd() {
  if (asked_to_end) return true;
  sigset_t waiting;
  if (sigpending(&waiting) != 0) return false;
  sigdelset(&waiting, SIGTTOU);
  return sigisemptyset(&waiting) == 0;
}

std::atomic<int> waits_forbidden = 0;

/// One of the two streams. Never destroyed: the last output is written when the process ends.
class Stream {
 public:
  explicit Stream(int fd) : fd_(fd) {}

  /// Reopens a terminal with its own non-blocking file description: one reported as writable may
  /// have room for one byte only, and block a writer of two. The description shared with others
  /// (the shell) is unchanged.
  void NeverWaitInATerminal() {
    if (isatty(fd_) == 0) return;
    const std::string path = fmt::format("/proc/self/fd/{}", fd_);
    const int own = open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (own >= 0) fd_ = own;
  }

  void SetErrorsOnly() { errors_only_ = true; }
  void SetColours(bool colours) { colours_ = colours; }
  [[nodiscard]] bool IsTerminal() const { return isatty(fd_) != 0; }

  void Take(std::string_view bytes) {
    const std::lock_guard lock(mutex_);
    if (error_ != 0 || (errors_only_ && !bytes.starts_with(kErrorBegins))) return;
    incomplete_ += bytes;
    const std::size_t whole = incomplete_.size() - IncompleteUtf8(incomplete_);
    Keep(Dressed(std::string_view(incomplete_).substr(0, whole)));
    incomplete_.erase(0, whole);
    WriteKept(waits_forbidden == 0);
  }

  /// Returns 0, or the error that lost output.
  int Finish() {
    const std::lock_guard lock(mutex_);
    Keep(Dressed(incomplete_));
    incomplete_.clear();
    WriteKept(true, kLook_ms);
    return error_;
  }

 private:
  /// Returns the text escaped, with its verdicts in colour if wanted.
  std::string Dressed(std::string_view text) {
    std::string escaped = EscapedForTerminal(text);
    const bool at_line_start = std::exchange(at_line_start_, escaped.ends_with('\n'));
    return colours_ ? WithColouredVerdicts(escaped, at_line_start) : escaped;
  }

  void Keep(std::string_view text) {
    if (kept_.size() + text.size() <= kMaxKept || waits_forbidden == 0) {
      kept_ += text;
    } else if (!cut_) {
      cut_ = true;
      kept_ += "\n[the reader was too slow: some words are missing here]\n";
    }
  }

  // @param last_ms  how long each piece waits for a reader even though the end was asked for
  void WriteKept(bool wait, int last_ms = 0) {
    std::size_t done = 0;
    while (error_ == 0 && done < kept_.size()) {
      pollfd ready{fd_, POLLOUT, 0};
      const int count = poll(&ready, 1, wait && !AskedToEnd() ? kLook_ms : last_ms);
      if (count == 0 && wait && !AskedToEnd()) continue;
      if (count == 0) break;
      if (count < 0 && errno == EINTR) continue;
      const ssize_t written =
          write(fd_, kept_.data() + done, std::min(kPiece, kept_.size() - done));
      if (written >= 0) {
        done += static_cast<std::size_t>(written);
      } else if (errno == EAGAIN) {
        if (!wait || AskedToEnd()) break;
        poll(nullptr, 0, kLook_ms);
      } else if (errno != EINTR) {
        error_ = errno;
      }
    }
    kept_.erase(0, error_ == 0 ? done : std::string::npos);
    if (kept_.empty()) cut_ = false;
  }

  std::mutex mutex_;
  int fd_;
  std::string incomplete_;  // the first bytes of a character
  std::string kept_;
  bool cut_ = false;
  bool errors_only_ = false;
  bool colours_ = false;
  bool at_line_start_ = true;
  int error_ = 0;
};

Stream& Output() {
  static Stream* const stream = new Stream(STDOUT_FILENO);
  return *stream;
}
Stream& Errors() {
  static Stream* const stream = new Stream(STDERR_FILENO);
  return *stream;
}

ssize_t TakeFromFile(void* stream, const char* bytes, std::size_t size) {
  static_cast<Stream*>(stream)->Take({bytes, size});
  return static_cast<ssize_t>(size);
}

std::FILE* FileOf(Stream& stream, int buffering) {
  std::FILE* file = fopencookie(&stream, "w", {nullptr, TakeFromFile, nullptr, nullptr});
  if (file != nullptr) std::setvbuf(file, nullptr, buffering, BUFSIZ);
  return file;
}

// Opens closed standard streams, whose descriptors the next opened file would otherwise get.
void OpenWhatIsClosed() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) != -1) continue;
    const int opened = open("/dev/null", O_RDWR);
    if (opened >= 0 && opened != fd) {
      dup2(opened, fd);
      close(opened);
    }
  }
}

}  // namespace

void GuardConsole() {
  OpenWhatIsClosed();
  std::signal(SIGPIPE, SIG_IGN);  // writing fails with EPIPE instead
  std::signal(SIGXFSZ, SIG_IGN);  // and with EFBIG
  Output().NeverWaitInATerminal();
  Errors().NeverWaitInATerminal();
  if (std::FILE* output = FileOf(Output(), _IOLBF)) stdout = output;
  if (std::FILE* errors = FileOf(Errors(), _IONBF)) stderr = errors;
}

void PrintErrorsOnly() { Errors().SetErrorsOnly(); }

void ColourVerdicts(Colour when) {
  const char* const none = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  const bool unwanted = (none != nullptr && *none != '\0') ||
                        (terminal != nullptr && std::string_view(terminal) == "dumb");
  for (Stream* stream : {&Output(), &Errors()}) {
    stream->SetColours(when == Colour::kAlways ||
                       (when == Colour::kAuto && !unwanted && stream->IsTerminal()));
  }
}

void WaitForNoReaderAnyMore() { asked_to_end = true; }

ConsoleDoesNotWait::ConsoleDoesNotWait() { ++waits_forbidden; }
ConsoleDoesNotWait::~ConsoleDoesNotWait() { --waits_forbidden; }

Result<void> FinishConsole() {
  std::fflush(stdout);
  const int error = Output().Finish();
  Errors().Finish();
  // A closed reader is no error: it has read what it wanted.
  if (error == 0 || error == EPIPE || error == EIO) return {};
  return Fail(fmt::format("standard output could not be written: {}", std::strerror(error)));
}

namespace {

constexpr std::string_view kKey = "verdict ";
constexpr std::string_view kGap = "  ";  // between the columns of a line
constexpr std::string_view kPlain = "\x1b[0m";
// Select Graphic Rendition (ECMA-48), by the words of VerdictText().
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kColours{
    {{"good", "\x1b[32m"}, {"cannot tell", "\x1b[33m"}, {"refused", "\x1b[31m"}}};

bool EndsColumn(std::string_view behind) {
  return behind.empty() || behind.front() == ':' || behind.front() == '\n' ||
         behind.starts_with(kGap);
}

/// Returns the line with a verdict in its first column coloured.
std::string Coloured(std::string_view line) {
  std::size_t gap = line.starts_with(kKey) ? kKey.size() - 1 : line.find(kGap);
  while (gap != std::string_view::npos) {
    const std::size_t column = line.find_first_not_of(' ', gap);
    if (column == std::string_view::npos) break;
    for (const auto& [word, colour] : kColours) {
      if (!line.substr(column).starts_with(word)) continue;
      const std::string_view behind = line.substr(column + word.size());
      if (!EndsColumn(behind)) continue;
      return std::string(line.substr(0, column))
          .append(colour)
          .append(word)
          .append(kPlain)
          .append(behind);
    }
    gap = line.find(kGap, column);
  }
  return std::string(line);
}

}  // namespace

std::string WithColouredVerdicts(std::string_view text, bool at_line_start) {
  std::string coloured;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, std::min(text.size(), text.find('\n')) + 1);
    coloured += at_line_start ? Coloured(line) : std::string(line);
    at_line_start = true;
    text.remove_prefix(line.size());
  }
  return coloured;
}

}  // namespace trammel::app

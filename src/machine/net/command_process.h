// Another program as a child, or this one again, whose words are read in lines while it runs.
#pragma once

#include <sys/types.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

enum class OutputStream { kOutput, kError };

/// How a child ended.
struct CommandEnd {
  int exit_code = -1;  ///< -1 where a signal ended it
  int signal = 0;      ///< which; 0: none

  /// "exit code 1" or "signal 11, Segmentation fault".
  [[nodiscard]] std::string Words() const;
};

/// A child that is asked to end, by SIGTERM, with the thread that started it or with its object,
/// whatever ends them, and is never killed: it may have a machine to leave safe.
class CommandProcess {
 public:
  using TakeLine = std::function<void(OutputStream, std::string_view)>;

  /// Starts a program, with an empty standard input, no other file of this process open, and every
  /// signal as usual. REQUIRES a thread that outlives the child.
  /// @param words  the program's path and its arguments, one word each, without a shell
  [[nodiscard]] static Result<std::unique_ptr<CommandProcess>> Start(
      const std::vector<std::string>& words);
  CommandProcess(const CommandProcess&) = delete;
  CommandProcess& operator=(const CommandProcess&) = delete;
  ~CommandProcess();

  /// Hands on each line, without its line feed and cut at 4096 bytes, until the child has ended.
  [[nodiscard]] CommandEnd Follow(const TakeLine& take);

  /// Asks it to end; thread-safe. Nothing where it has ended.
  void AskToEnd();

  [[nodiscard]] pid_t process() const { return process_; }

 private:
  struct Pipe {
    int fd = -1;
    std::string line;
    bool cut = false;  ///< the rest of this line is passed over
  };

  CommandProcess(pid_t process, int output, int error);
  [[nodiscard]] bool Read(OutputStream stream, const TakeLine& take);
  [[nodiscard]] bool HasEnded();
  void Wait();

  const pid_t process_;
  Pipe output_;
  Pipe error_;
  std::mutex mutex_;  // of what follows: a process that was waited for must not be signalled
  bool ended_ = false;
  int status_ = 0;
};

}  // namespace trammel::machine

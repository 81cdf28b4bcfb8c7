// Another program as a child, or this one again, whose words are read in lines while it runs.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

enum class OutputStream { kOutput, kError };

/// How a child ended.
struct CommandEnd {
  enum class Cause { kItself, kSilence, kStop };
  int exit_code = -1;  ///< -1 where a signal ended it
  int signal = 0;      ///< which; 0: none
  Cause cause = Cause::kItself;

  /// "exit code 1" or "signal 11, Segmentation fault".
  [[nodiscard]] std::string Words() const;
};

/// When a child is asked to end, and how long that may take.
struct CommandLimits {
  std::stop_token stop = {};
  double silence_s = std::numeric_limits<double>::infinity();  ///< without a word of it
  /// From then on, until it is killed. Without end for one that has a machine to leave safe.
  double rest_s = std::numeric_limits<double>::infinity();
};

/// A child that is asked to end, by SIGTERM, with the thread that started it or with its object,
/// whatever ends them.
class CommandProcess {
 public:
  using TakeLine = std::function<void(OutputStream, std::string_view)>;

  /// Starts a program, with an empty standard input, no other file of this process open, and every
  /// signal as usual. REQUIRES a thread that outlives the child.
  /// @param words  the program's path and its arguments, one word each, without a shell
  /// @param most_file_bytes  of a file that it writes: SIGXFSZ ends one that writes more
  [[nodiscard]] static Result<std::unique_ptr<CommandProcess>> Start(
      const std::vector<std::string>& words,
      std::optional<std::uint64_t> most_file_bytes = std::nullopt);
  CommandProcess(const CommandProcess&) = delete;
  CommandProcess& operator=(const CommandProcess&) = delete;
  ~CommandProcess();

  /// Hands on each line, cut at 4096 bytes, until the child has ended. A line ends at a line feed,
  /// or at the carriage return behind which a display of progress is written anew.
  [[nodiscard]] CommandEnd Follow(const TakeLine& take, const CommandLimits& limits = {});

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
  void Signal(int number);

  const pid_t process_;
  Pipe output_;
  Pipe error_;
  std::mutex mutex_;  // of what follows: a process that was waited for must not be signalled
  bool ended_ = false;
  int status_ = 0;
};

}  // namespace trammel::machine

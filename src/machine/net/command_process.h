// Another program, or this one again, as a child whose output is read line by line while it runs.
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

struct CommandEnd {
  enum class Cause { kItself, kSilence, kStop };
  int exit_code = -1;  ///< -1 where a signal ended it
  int signal = 0;      ///< signal number; 0: none
  Cause cause = Cause::kItself;

  /// "exit code 1" or "signal 11, Segmentation fault".
  [[nodiscard]] std::string Describe() const;
};

/// Conditions for ending a child, and the time allowed.
struct CommandLimits {
  std::stop_token stop = {};
  double silence_s = std::numeric_limits<double>::infinity();  ///< without a word of it
  /// Time from then until it is killed, s. Infinite for a child that must first make a machine
  /// safe.
  double rest_s = std::numeric_limits<double>::infinity();
};

/// Child that receives SIGTERM when the thread that started it or its object ends, for any reason.
class CommandProcess {
 public:
  using TakeLine = std::function<void(OutputStream, std::string_view)>;

  /// Starts a program with an empty standard input, no other file of this process open, and default
  /// signals. REQUIRES a thread that outlives the child.
  /// @param words  the program's path and its arguments, one word each, without a shell
  /// @param most_file_bytes  maximum size of a file it writes: SIGXFSZ ends one that writes more
  [[nodiscard]] static Result<std::unique_ptr<CommandProcess>> Start(
      const std::vector<std::string>& words,
      std::optional<std::uint64_t> max_file_bytes = std::nullopt);
  CommandProcess(const CommandProcess&) = delete;
  CommandProcess& operator=(const CommandProcess&) = delete;
  ~CommandProcess();

  /// Passes on each line, cut at 4096 bytes, until the child has ended. A line ends at a line feed,
  /// or at the carriage return after which a progress display is rewritten.
  [[nodiscard]] CommandEnd Follow(const TakeLine& take, const CommandLimits& limits = {});

  /// Asks the child to end; thread-safe. No effect after its end.
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
  std::mutex mutex_;  // guards the members below: a reaped process must not be signalled
  bool ended_ = false;
  int status_ = 0;
};

}  // namespace trammel::machine

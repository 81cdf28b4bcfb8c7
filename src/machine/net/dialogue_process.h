// Another program as a child, with line-based requests on its standard input and answers on its
// standard output.
#pragma once

#include <sys/types.h>

#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// Child in its own process group, which Ctrl-C at the terminal does not reach. Its input ends with
/// this process or its object, and it must end with its input.
class DialogueProcess {
 public:
  /// Starts a program with no other file of this process open; its standard error is shown.
  /// @param words  its path, or its name on PATH, and its arguments, one word each, without a shell
  /// Errors (kMachine): it cannot be started.
  [[nodiscard]] static Result<std::unique_ptr<DialogueProcess>> Start(
      const std::vector<std::string>& words);
  DialogueProcess(const DialogueProcess&) = delete;
  DialogueProcess& operator=(const DialogueProcess&) = delete;
  /// Closes its input and waits; kills it after thirty seconds.
  ~DialogueProcess();

  /// Sends a line and waits for one. Errors: kMachine (it has ended, a line of more than 64 kB, no
  /// answer in time), kInterrupted (stop). After an error, answers can no longer be matched to
  /// requests.
  [[nodiscard]] Result<std::string> Ask(std::string_view line, double time_limit_s,
                                        const std::stop_token& stop);
  /// Waits for an unsolicited line.
  [[nodiscard]] Result<std::string> ReadLine(double time_limit_s, const std::stop_token& stop);

  [[nodiscard]] pid_t process() const { return process_; }

 private:
  DialogueProcess(pid_t process, int fd) : process_(process), fd_(fd) {}

  pid_t process_;
  int fd_;
  std::string partial_;
};

}  // namespace trammel::machine

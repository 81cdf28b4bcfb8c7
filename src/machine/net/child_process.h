// Work in a separate process that returns its results in messages: a hang or crash there does not
// affect this process.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

struct ChildMessage {
  std::uint32_t kind = 0;
  std::vector<std::uint8_t> bytes;
};

/// Child's end of the pipe.
class ChildSender {
 public:
  explicit ChildSender(int fd) : fd_(fd) {}
  /// Sends a message. False if the receiver is gone: clean up and return.
  bool Send(std::uint32_t kind, std::span<const std::uint8_t> bytes) const;
  bool Send(std::uint32_t kind, std::string_view text) const;

 private:
  int fd_;
};

enum class Received {
  kMessage,
  kSilence,  ///< nothing for as long as it was given
  kStopped,
  kEnded,  ///< the child has gone, and has said all
};

/// Forked child. Ends with the object at the latest, and with its parent: by SIGTERM first, then by
/// SIGKILL.
class ChildProcess {
 public:
  /// Forks. `work` runs in the child, which then ends without this program's exit handlers. SIGTERM
  /// has its default action there until `work` changes that; SIGINT (meant for the parent) and
  /// SIGPIPE are ignored. The child's output is printed to standard error.
  /// REQUIRES that no other thread of this process holds a lock that `work` needs.
  /// @param patience_s  time for the child to end, after the request and before it.
  [[nodiscard]] static Result<ChildProcess> Start(
      const std::function<void(const ChildSender&)>& work, double patience_s);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  /// Waits for a message. Malformed data (a child may write anything) counts as its end.
  [[nodiscard]] Received Receive(ChildMessage& message, double silence_s,
                                 const std::stop_token& stop);

  /// Returns its end, "signal 11, Segmentation fault" or "exit code 1". Waits like the destructor.
  [[nodiscard]] std::string End();

 private:
  ChildProcess(pid_t process, int fd, double patience_s)
      : process_(process), fd_(fd), patience_s_(patience_s) {}
  [[nodiscard]] Received ReceiveBytes(std::span<std::uint8_t> bytes, double silence_s,
                                      const std::stop_token& stop) const;
  [[nodiscard]] bool WaitForEnd();

  pid_t process_ = -1;  // -1: it has been waited for
  int fd_ = -1;
  double patience_s_ = 0;
  int status_ = 0;
};

/// Limits the calling process to so many additional bytes and to a computing time; meant for a
/// ChildProcess. Under a sanitizer, whose processes have terabytes of addresses, limits only the
/// time.
void LimitThisProcess(std::uint64_t bytes, int seconds);

}  // namespace trammel::machine

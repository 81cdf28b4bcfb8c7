// Progress of commands that only compute.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace trammel::app {

/// Prints the current step of a command on standard error while it lives: after the first second,
/// and then every ten. Prints nothing if the work ends sooner.
class SlowWork {
 public:
  /// @param what  a line of progress: "reading the photo"
  /// @param first, again  when it speaks first, and how long it then waits each time
  explicit SlowWork(std::string what, std::chrono::milliseconds first = std::chrono::seconds(1),
                    std::chrono::milliseconds again = std::chrono::seconds(10));

 private:
  void Speak(const std::stop_token& end, std::chrono::milliseconds first,
             std::chrono::milliseconds again);

  std::string what_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;  // last: stopped and joined before the others go
};

// Memory for the pictures of an analysis.

/// Retains freed memory for the next picture: every step of an analysis allocates and frees buffers
/// of a photo's size. Returning them each time costs a fifth of the whole analysis, in pages that
/// the system clears again.
void KeepPicturesMemory();

}  // namespace trammel::app

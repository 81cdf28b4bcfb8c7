// Progress of commands that only compute.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace trammel::app {

/// Says on standard error what a command is at, while it lives: after the first second, and again
/// every ten. Says nothing of work that is done sooner.
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

// What the pictures of an analysis take from the system.

/// Keeps freed memory for the next picture: every step of an analysis takes and frees some of a
/// photo's size, and to give it back each time costs a fifth of the whole analysis, in pages that
/// the system clears again.
void KeepPicturesMemory();

}  // namespace trammel::app

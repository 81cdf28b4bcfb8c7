// A command of trammel that measures what a browser sent, in a process of its own.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

namespace trammel::panel {

struct MeasuringEnd {
  std::string output;               ///< its standard output, at most 16 MB
  std::vector<std::string> errors;  ///< first lines of its standard error, at most three
  std::string end;                  ///< how it ended, for an error without a line

  /// Returns the errors as one text; how it ended where there are none.
  [[nodiscard]] std::string Why() const;
};

/// One measuring at a time. A page whose link broke asks again meanwhile: two more wait.
class MeasuringQueue {
 public:
  class Turn {
   public:
    explicit Turn(std::unique_lock<std::timed_mutex> lock) : lock_(std::move(lock)) {}

   private:
    std::unique_lock<std::timed_mutex> lock_;
  };
  /// Waits for the turn, 100 s at most. Errors (kMachine): two wait already, or it was too long.
  [[nodiscard]] Result<Turn> Wait();

 private:
  std::timed_mutex measuring_;
  std::atomic<int> waiting_ = 0;
};

/// Runs a command until it ends. One that is silent for two minutes is ended.
/// @param words  the program's path and its arguments
/// @param log    receives its standard error
/// Errors: it cannot be started.
[[nodiscard]] Result<MeasuringEnd> RunMeasuring(const std::vector<std::string>& words,
                                                const std::function<void(const std::string&)>& log,
                                                const std::stop_token& stop);

}  // namespace trammel::panel

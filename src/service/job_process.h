// A job's process, and how much jobs of one printer may do by themselves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/net/command_process.h"
#include "session/session.h"

namespace trammel::service {

/// How a job's process ended.
struct JobEnd {
  bool stopped = false;                  ///< it was interrupted, and says that it ended safely
  bool killed = false;                   ///< a signal ended it: what it did last is not known
  int exit_code = -1;                    ///< as CONVENTIONS.md has them; -1: a signal, or none
  std::vector<std::string> errors = {};  ///< its last ones, a line each; the last of them ended it
  std::vector<std::string> output = {};  ///< the last lines of its answer
};

/// Starts a command of trammel, and may be asked to stop it from any thread. Once only.
class JobProcess {
 public:
  using Tell = std::function<void(const procedure::Progress&)>;
  using Log = std::function<void(const std::string&)>;

  /// Runs the command to its end. The process is asked to end with this one, and with the calling
  /// thread. @param words  the program's path and its arguments
  /// @param tell  each progress   @param log  each other line of either stream
  [[nodiscard]] JobEnd Run(const std::vector<std::string>& words, const Tell& tell, const Log& log);

  /// Asks it to end safely, now or as soon as it has been started.
  void Stop();

 private:
  std::mutex mutex_;
  bool stopped_ = false;
  machine::CommandProcess* process_ = nullptr;  // while it runs
};

// Bounds what clients of a service can have it keep on the disk.

struct RunBudget {
  std::size_t most_runs_a_day = 200;                           ///< that left a folder
  std::uintmax_t most_copied_bytes = std::uintmax_t{2} << 30;  ///< of uploads, in all runs
};

/// Looks whether one more run may begin, and removes copies of uploads, the oldest first, until all
/// of them fit the budget: photo.jpg, scan-2.pdf. Looks at folders with the names of runs alone,
/// and follows no link.
/// @param utc_now  ISO 8601, ending in Z
/// Errors (kMeasurement): the day's runs have begun.
[[nodiscard]] Result<void> MakeRoomForRun(const std::filesystem::path& recordings,
                                          const std::string& utc_now, const RunBudget& budget = {});

}  // namespace trammel::service

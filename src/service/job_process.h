// Job's process, and limits on the jobs of one printer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/net/command_process.h"
#include "session/session.h"

namespace trammel::service {

struct JobEnd {
  bool stopped = false;  ///< on request; unless it was killed, it reports a safe end
  bool killed = false;   ///< a signal ended it: what it did last is not known
  int exit_code = -1;    ///< as in CONVENTIONS.md; -1: a signal, or none
  std::vector<std::string> errors = {};  ///< latest errors, one per line; the last ended the job
  std::vector<std::string> output = {};  ///< the last lines of its answer
};

/// Starts a command of trammel, which any thread may stop. Used once only.
class JobProcess {
 public:
  using ProgressCallback = std::function<void(const procedure::Progress&)>;
  using Log = std::function<void(const std::string&)>;

  /// Runs the command to its end. The process is asked to end with this one, and with the calling
  /// thread. @param words  the program's path and its arguments
  /// @param tell  each progress   @param log  each other line of either stream
  [[nodiscard]] JobEnd Run(const std::vector<std::string>& words, const ProgressCallback& tell,
                           const Log& log);

  /// Asks the process to end safely, now or as soon as it has been started.
  void Stop();

 private:
  std::mutex mutex_;
  bool stopped_ = false;
  machine::CommandProcess* process_ = nullptr;  // while it runs
};

// Limits on the disk space that clients of a service can use.

struct RunBudget {
  std::size_t max_runs_a_day = 200;                           ///< with a folder
  std::size_t max_uploads_a_day = 1000;                       ///< likewise, of a page
  std::uintmax_t max_copied_bytes = std::uintmax_t{2} << 30;  ///< total uploads, all runs
};

/// Folders of recordings that something works with: what is made or set is not deleted meanwhile.
/// Thread-safe; shared by all servers of a process.
class FoldersInUse {
 public:
  /// Holds a folder while it lives.
  using Hold = std::shared_ptr<void>;
  /// @returns null: it is being deleted.
  [[nodiscard]] Hold Use(const std::filesystem::path& folder);
  /// @returns null: it is in use.
  [[nodiscard]] Hold Delete(const std::filesystem::path& folder);

 private:
  std::mutex mutex_;
  std::map<std::filesystem::path, int> users_;  // -1: being deleted
};

/// Kind in the names of the folders that a page uploads into: upload-20260102T030405Z.
inline constexpr std::string_view kUpload = "upload";
/// Likewise of surveys; they count as uploads.
inline constexpr std::string_view kSurvey = "survey";

/// Checks that one more run of a kind may begin, and removes copies of uploads (photo.jpg,
/// scan-2.pdf), the oldest first, until all fit the budget. Only enters folders with the names of
/// runs, and follows no link.
/// @param utc_now  ISO 8601, ending in Z
/// Errors (kMeasurement): the day's number of runs is reached.
[[nodiscard]] Result<void> MakeRoomForRun(const std::filesystem::path& recordings,
                                          const std::string& utc_now, std::string_view kind,
                                          const RunBudget& budget = {});

/// Removes copies of uploads, the oldest first, until all fit the budget.
void RemoveOldCopies(const std::filesystem::path& recordings, const RunBudget& budget = {});

/// Makes room, and a new folder KIND-TIME. @returns its name. Errors: MakeRoomForRun's; kInput: it
/// cannot be made.
[[nodiscard]] Result<std::string> MakeRunFolder(const std::filesystem::path& recordings,
                                                const std::string& utc_now, std::string_view kind);

}  // namespace trammel::service

// Cuts the videos of a recording to what is read of them, while the next lines are swept.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "base/result.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::procedure {

/// Cuts a video (machine/video/video_cutter.h), once each of its lines reads well within the crop
/// and every frame's crop is the same to the bit in the cut. A whole frame stays every 6 s.
/// @param scan  with the crop and the lines of this video alone.
/// Errors, which leave the video whole: a line cannot be read, or its bead reaches out of the
/// crop; the video's, the disk's, kInterrupted.
[[nodiscard]] Result<void> CutLine(const std::filesystem::path& folder,
                                   const pressure_advance::Scan& scan, const std::stop_token& stop);

/// Cuts lines one after the other on a thread of its own, behind all that keep pace with a machine.
class RecordingCutter {
 public:
  RecordingCutter();
  RecordingCutter(const RecordingCutter&) = delete;
  RecordingCutter& operator=(const RecordingCutter&) = delete;
  ~RecordingCutter();  ///< leaves whole what is not cut yet

  /// Puts a video behind the others; returns at once. REQUIRES a crop, and lines of one video.
  void Add(std::filesystem::path folder, pressure_advance::Scan scan);

  /// Cuts what still waits, on the calling thread too: nothing has to keep pace any more. Returns
  /// when all are done, or at the stop. @returns a sentence for each line that stays whole.
  [[nodiscard]] std::vector<std::string> Finish(const std::stop_token& stop);

 private:
  struct Line {
    std::filesystem::path folder;
    pressure_advance::Scan scan;
  };
  void Work(const std::stop_token& stop);
  void CutNext(std::unique_lock<std::mutex>& lock, const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Line> waiting_;
  int busy_ = 0;  // threads that cut
  std::vector<std::string> whole_;
  std::jthread worker_;  // stopped and joined first: the last member
};

}  // namespace trammel::procedure

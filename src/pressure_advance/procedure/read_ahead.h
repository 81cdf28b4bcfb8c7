// Reads the lines of a recording while others are still swept.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/laser/laser_eye.h"
#include "pressure_advance/procedure/recorded_frames.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::procedure {

/// A line that was read before.
struct LineAhead {
  std::vector<Frame> frames;               ///< as ReadFrames() gives them
  pressure_advance::SweepReading reading;  ///< by the positions that they had then
};

/// Keeps what ReadFrames() and ReadSweep() read of lines, on a thread of its own, behind all that
/// keep pace with a machine. Frames of some 256 MB in all: what is beyond them has to be read when
/// it is wanted, as what cannot be read before its frames have their places.
class ReadAhead {
 public:
  ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;
  ~ReadAhead() = default;  ///< the thread is stopped and joined first: it is the last member

  /// Puts a video behind the others; returns at once. REQUIRES a crop, and lines of one video.
  void Add(std::filesystem::path folder, pressure_advance::Scan scan);

  /// Waits until all videos are read. For tests: a scan never waits for it.
  void WaitForAll();

  /// What was read of this line, once. Absent where it was not read with this crop, or
  /// not to an end: whoever wants it now is not behind others.
  [[nodiscard]] std::optional<LineAhead> Take(const std::filesystem::path& folder,
                                              const pressure_advance::Scan& scan,
                                              const pressure_advance::ScanLine& line,
                                              const FrameSize& size);

 private:
  struct Video {
    std::filesystem::path path;  // in its folder
    std::filesystem::path folder;
    pressure_advance::Scan scan;  // with the lines of this video alone
  };
  struct Read {
    PixelRect crop;
    AxisDirection height_direction = AxisDirection::kMinusX;
    FrameSize size;
    std::vector<Frame> frames;  // all of them, until a line takes its own
    std::vector<std::optional<pressure_advance::SweepReading>> lines;  // absent once taken
  };
  void Work(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Video> waiting_;
  bool reading_ = false;
  std::map<std::filesystem::path, Read> read_;
  std::size_t bytes_ = 0;  // of all frames read so far
  std::jthread worker_;
};

}  // namespace trammel::procedure

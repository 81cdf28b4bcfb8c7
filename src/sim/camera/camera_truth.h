// What the virtual camera knows of its frames and its clients do not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <vector>

#include "base/result.h"
#include "sim/camera/camera_view.h"

namespace trammel::sim {

/// One frame that at least one client was sent. Times on the host's monotonic clock.
struct CameraTruth {
  std::int64_t frame = 0;    ///< from the server's start, lost ones counted
  double capture_s = 0;      ///< the true middle of its exposure
  double stamp_s = 0;        ///< what its headers say
  double sent_s = 0;         ///< when its way to the first client began
  MachineView machine;       ///< at mid-exposure
  CameraView::Spot spot;     ///< where the laser meets the plate at the focus height
  bool shown_black = false;  ///< by a fault
  bool laser_hidden = false;
  bool half = false;
};

/// Keeps the latest 100,000 frames (an hour at 30 frames/s); with a file, all. Safe to use from
/// several threads.
class CameraTruthLog {
 public:
  CameraTruthLog() = default;
  /// Also writes a JSON object per line to a new file, each as soon as it is known.
  /// Error (kInput): the file cannot be created.
  [[nodiscard]] Result<void> WriteTo(const std::filesystem::path& path);

  void Add(const CameraTruth& truth);
  [[nodiscard]] std::vector<CameraTruth> rows() const;

 private:
  static constexpr std::size_t kMostRows = 100000;
  mutable std::mutex mutex_;
  std::deque<CameraTruth> rows_;
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace trammel::sim

#include "sim/camera_truth.h"

#include <fmt/format.h>

namespace trammel::sim {

Result<void> CameraTruthLog::WriteTo(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex_);
  file_.open(path, std::ios::binary | std::ios::trunc);
  if (!file_) {
    return Fail(fmt::format(
        "{}: the camera's truth cannot be written there; does the folder exist?", path.string()));
  }
  return {};
}

void CameraTruthLog::Add(const CameraTruth& truth) {
  const std::lock_guard lock(mutex_);
  rows_.push_back(truth);
  if (rows_.size() > kMostRows) rows_.pop_front();
  if (!file_.is_open()) return;
  file_ << fmt::format(
               "{{\"frame\": {}, \"capture_s\": {:.6f}, \"stamp_s\": {:.6f}, \"sent_s\": {:.6f}, "
               "\"x_mm\": {:.5f}, \"y_mm\": {:.5f}, \"z_mm\": {:.5f}, \"laser_x_mm\": {:.5f}, "
               "\"laser_y_mm\": {:.5f}, \"laser_on\": {}, \"lights_on\": {}, \"black\": {}, "
               "\"laser_hidden\": {}, \"half\": {}}}\n",
               truth.frame, truth.capture_s, truth.stamp_s, truth.sent_s, truth.machine.x_mm,
               truth.machine.y_mm, truth.machine.z_mm, truth.spot.x_mm, truth.spot.y_mm,
               truth.machine.laser_on, truth.machine.lights_on, truth.shown_black,
               truth.laser_hidden, truth.half)
        << std::flush;
}

std::vector<CameraTruth> CameraTruthLog::rows() const {
  const std::lock_guard lock(mutex_);
  return {rows_.begin(), rows_.end()};
}

}  // namespace trammel::sim

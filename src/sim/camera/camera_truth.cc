#include "sim/camera/camera_truth.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace trammel::sim {

Result<void> CameraTruthLog::WriteTo(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex_);
  file_.reset(std::fopen(path.c_str(), "wxe"));
  if (file_) return {};
  return Fail(
      fmt::format("{}: the camera's truth cannot be written there: {}; choose a new file in "
                  "a folder that is there",
                  path.string(), std::strerror(errno)));
}

void CameraTruthLog::Add(const CameraTruth& truth) {
  const std::lock_guard lock(mutex_);
  rows_.push_back(truth);
  if (rows_.size() > kMostRows) rows_.pop_front();
  if (!file_) return;
  const std::string row = fmt::format(
      "{{\"frame\": {}, \"capture_s\": {:.6f}, \"stamp_s\": {:.6f}, \"sent_s\": {:.6f}, "
      "\"x_mm\": {:.5f}, \"y_mm\": {:.5f}, \"z_mm\": {:.5f}, \"laser_x_mm\": {:.5f}, "
      "\"laser_y_mm\": {:.5f}, \"laser_on\": {}, \"lights_on\": {}, \"black\": {}, "
      "\"laser_hidden\": {}, \"half\": {}}}\n",
      truth.frame, truth.capture_s, truth.stamp_s, truth.sent_s, truth.machine.x_mm,
      truth.machine.y_mm, truth.machine.z_mm, truth.spot.x_mm, truth.spot.y_mm,
      truth.machine.laser_on, truth.machine.lights_on, truth.shown_black, truth.laser_hidden,
      truth.half);
  std::fwrite(row.data(), 1, row.size(), file_.get());
  std::fflush(file_.get());
}

std::vector<CameraTruth> CameraTruthLog::rows() const {
  const std::lock_guard lock(mutex_);
  return {rows_.begin(), rows_.end()};
}

}  // namespace trammel::sim

#include "support/lag_recording.h"

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::test {

std::vector<Frame> RecordSweep(const LagRecording& recording, double pressure_advance_s,
                               Random& random) {
  const testing::LagLine& line = recording.line;
  const std::vector<double> area = PrintLagLine(line, recording.law, pressure_advance_s);
  const double flow = 1 + recording.flow_scatter * random.Normal();
  const auto first = static_cast<std::size_t>(std::lround(recording.line_start_mm / line.step_mm));
  const auto end = static_cast<std::size_t>(
      std::lround((line.length_mm - recording.line_start_mm) / line.step_mm));
  std::vector<Frame> frames;
  for (std::size_t i = first; i < end; ++i) {
    frames.push_back(DrawLaserFrame(recording.world, recording.area_mm2 * flow * area[i], random));
  }
  return frames;
}

void WriteRecording(const LagRecording& recording, const std::filesystem::path& folder) {
  constexpr double kFramesPerSecond = 30;
  const testing::LagLine& line = recording.line;
  nlohmann::ordered_json scan = {
      {"format", 1},
      {"eye", "laser"},
      {"frames_per_s", kFramesPerSecond},
      {"scan_speed_mm_s", line.step_mm * kFramesPerSecond},
      {"px_per_mm", recording.world.px_per_mm},
      {"laser_angle_deg", 45},
      {"height_direction", "-x"},
      {"crop_px",
       {{"x", 0}, {"y", 0}, {"width", recording.world.width}, {"height", recording.world.height}}},
      {"line_start_mm", recording.line_start_mm},
      {"line_length_mm", line.length_mm},
      {"segments", nlohmann::ordered_json::array()},
      {"acceleration_mm_s2", line.acceleration_mm_s2},
      {"lines", nlohmann::ordered_json::array()}};
  const auto segment = [&](double fraction, double speed_mm_s) {
    scan["segments"].push_back({{"fraction", fraction}, {"speed_mm_s", speed_mm_s}});
  };
  segment(line.slow_before, line.slow_mm_s);
  segment(1 - line.slow_before - line.slow_after, line.fast_mm_s);
  segment(line.slow_after, line.slow_mm_s);
  Random random(recording.seed);
  for (const double value : recording.pressure_advance_s) {
    const std::string video = "line" + std::to_string(scan["lines"].size()) + ".avi";
    const std::vector<Frame> frames = RecordSweep(recording, value, random);
    WriteAvi(folder / video, frames, static_cast<std::uint32_t>(frames.size()));
    scan["lines"].push_back({{"pressure_advance_s", value}, {"video", video}});
  }
  WriteWhole(folder / "scan.json", scan.dump(2));
}

}  // namespace trammel::test

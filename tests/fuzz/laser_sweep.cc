// A sweep of very small frames: width, height and how it was swept, then pixels that all frames
// take in turn, each beginning one further on.
#include <cmath>
#include <vector>

#include "base/frame.h"
#include "fuzz.h"
#include "pressure_advance/laser/deviation.h"
#include "pressure_advance/laser/laser_eye.h"
#include "pressure_advance/recording/scan.h"

namespace {

using namespace trammel;

constexpr std::size_t kHead = 3;
constexpr int kSmallest_px = 8;  // of a crop
constexpr int kFrames = 8;

std::vector<Frame> FramesOf(const std::uint8_t* data, std::size_t size) {
  // Few pixels: each line that is tried is judged by all of them.
  const Frame blank(kSmallest_px + data[0] % 8, kSmallest_px + data[1] % 8);
  std::vector<Frame> frames(kFrames, blank);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (std::size_t k = 0; k < frames[i].bgr.size(); ++k) {
      frames[i].bgr[k] = data[kHead + (i + k) % (size - kHead)];
    }
  }
  return frames;
}

}  // namespace

TRAMMEL_FUZZ_TARGET(laser_sweep)(const std::uint8_t* data, std::size_t size) {
  if (size <= kHead) return 0;
  const std::vector<Frame> frames = FramesOf(data, size);
  pressure_advance::Scan scan;
  scan.scan_speed_mm_s = 40;
  scan.motion.length_mm = 30;
  scan.motion.acceleration_mm_s2 = 3000;
  scan.motion.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
  if ((data[2] & 1) != 0) scan.px_per_mm = 20;
  if ((data[2] & 2) != 0) scan.height_direction = AxisDirection::kPlusX;
  pressure_advance::ScanLine line;
  line.video = "line.avi";
  for (int i = 0; (data[2] & 4) != 0 && i < kFrames; ++i) {
    line.frame_positions_mm.emplace_back(i % 5 == 4 ? std::nullopt : std::optional(1.25 * i));
  }
  scan.lines = {line};
  if (!fuzz::Good(pressure_advance::Validate(scan))) return 0;
  vision::LaserLineWorkspace workspace;
  const auto reading = pressure_advance::ReadSweep(frames, scan, line, {}, workspace);
  for (const pressure_advance::ProfileSample& sample : reading.profile.samples) {
    fuzz::Require(std::isfinite(sample.position), "a sample has a place");
  }
  pressure_advance::DeviationFrame scratch;
  const auto paper =
      pressure_advance::DeviationHeights(frames, reading.frame, scan.height_direction, {}, scratch);
  const auto score = pressure_advance::DeviationScore(paper);
  fuzz::Require(!score || std::isfinite(*score), "a score is a number");
  return 0;
}

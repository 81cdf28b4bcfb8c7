#include "pressure_advance/procedure/placed_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "base/parallel.h"
#include "vision/frame_change.h"

namespace trammel::procedure {

using machine::CapturedFrame;
using pressure_advance::FrameMotion;
using pressure_advance::FrameObservation;
using pressure_advance::LineMove;
using pressure_advance::SweepObservation;

namespace {

/// Observes frames `first` to `end`, and decodes the one before them.
Result<void> ObserveChunk(std::span<const CapturedFrame> frames, std::size_t first, std::size_t end,
                          std::span<FrameObservation> observed) {
  const vision::FrameChangeOptions options;
  vision::FrameSketch sketch, before;
  std::vector<float> scratch;
  for (std::size_t i = first == 0 ? 0 : first - 1; i < end; ++i) {
    const CapturedFrame& frame = frames[i];
    const auto picture = machine::DecodeFrame(frame);
    if (!picture) return tl::unexpected(picture.error());
    std::swap(sketch, before);
    vision::SketchFrame(picture->view(), options, sketch);
    if (i < first) continue;
    FrameObservation& seen = observed[i];
    seen.arrival_s = frame.arrival_s;
    if (frame.captured) seen.captured_s = frame.captured->time_s;
    seen.sequence = frame.sequence;
    if (before.width == sketch.width && before.height == sketch.height) {
      seen.change = vision::FrameChange(before, sketch, options, scratch);
    }
  }
  return {};
}

}  // namespace

std::vector<LineMove> AlongLine(std::span<const machine::TrapezoidMove> moves, const Sweep& sweep,
                                const machine::ClockRelation& clock,
                                const std::array<double, 4>& gcode_origin_mm) {
  std::vector<LineMove> along;
  for (const machine::TrapezoidMove& move : moves) {
    const double share = move.direction[0] * sweep.along_x + move.direction[1] * sweep.along_y;
    if (!(move.duration_s > 0) || share == 0) continue;
    along.push_back({clock.HostTimeOf(move.print_time_s), move.duration_s,
                     sweep.PositionOf(move.start_mm[0] - gcode_origin_mm[0],
                                      move.start_mm[1] - gcode_origin_mm[1]),
                     move.start_velocity_mm_s * share, move.acceleration_mm_s2 * share});
  }
  return along;
}

Result<SweepObservation> Observe(std::span<const CapturedFrame> frames,
                                 std::vector<LineMove> motion) {
  constexpr std::size_t kChunk = 32;
  SweepObservation sweep;
  sweep.motion = std::move(motion);
  sweep.frames.resize(frames.size());
  std::vector<Result<void>> done((frames.size() + kChunk - 1) / kChunk);
  ParallelFor(static_cast<int>(done.size()), [&](int chunk) {
    const std::size_t first = kChunk * static_cast<std::size_t>(chunk);
    const std::size_t end = std::min(first + kChunk, frames.size());
    done[static_cast<std::size_t>(chunk)] = ObserveChunk(frames, first, end, sweep.frames);
  });
  for (const Result<void>& chunk : done) {
    if (!chunk) return tl::unexpected(chunk.error());
  }
  return sweep;
}

std::vector<std::optional<double>> ScoredPositions(const pressure_advance::SweepTiming& timing) {
  std::vector<std::optional<double>> positions;
  for (const pressure_advance::FrameTiming& frame : timing.frames) {
    positions.emplace_back();
    if (frame.motion == FrameMotion::kSteady) positions.back() = frame.position_mm;
  }
  return positions;
}

Result<double> Reddened(const CapturedFrame& before, const CapturedFrame& after) {
  constexpr int kLevels = 30;  // far above a camera's noise, far below a laser's line
  const auto first = machine::DecodeFrame(before);
  if (!first) return tl::unexpected(first.error());
  const auto second = machine::DecodeFrame(after);
  if (!second) return tl::unexpected(second.error());
  if (first->width != second->width || first->height != second->height) {
    return Fail(fmt::format("the camera changed the size of its pictures from {}x{} to {}x{} px",
                            first->width, first->height, second->width, second->height),
                ErrorKind::kMachine);
  }
  std::size_t redder = 0;
  for (std::size_t i = 2; i < first->bgr.size(); i += 3) {
    redder += second->bgr[i] >= first->bgr[i] + kLevels;
  }
  return static_cast<double>(redder) / (static_cast<double>(first->bgr.size()) / 3);
}

}  // namespace trammel::procedure
